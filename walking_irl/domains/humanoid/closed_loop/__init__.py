"""The gait in forward dynamics: controller, environment, rollouts."""
