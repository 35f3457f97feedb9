"""The walker's body: what MuJoCo's model says of it."""
