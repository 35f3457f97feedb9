"""The walking humanoid: model, optimal gait, closed loop, expert."""
