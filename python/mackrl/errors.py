"""What can go wrong, beside what Python's own exceptions say."""

__all__ = ["IllegalAction", "WorldFailed"]


class IllegalAction(ValueError):
    """An action that is not available to its agent. No world has moved.

    Attributes:
        env: index of the world.
        agent: index of the agent.
        action: what it chose.
    """

    def __init__(self, env: int, agent: int, action: int) -> None:
        self.env, self.agent, self.action = env, agent, action
        super().__init__(f"actions[{env}, {agent}] is {action}, which is not available to that agent")

    def __reduce__(self) -> tuple[type["IllegalAction"], tuple[int, int, int]]:
        return type(self), (self.env, self.agent, self.action)


class WorldFailed(RuntimeError):
    """A world that is the user's own could not go on; its episode is void."""
