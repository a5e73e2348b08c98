"""Settings in which what a tracker says of its own error is not to be believed.

A band of 95 % should hold the truth in 95 % of the reports. Where a method cannot do that, whoever declares the tracker
says so, with the setting and the reason; whoever shows, summarises or exports a run passes the reason on.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from pftrack.model.parameters import Value

__all__ = ["Overconfidence", "reasons"]


@dataclass(frozen=True, slots=True)
class Overconfidence:
    """A setting in which bands hold the truth less often than they say.

    Attributes:
        trackers: Names of those that it is about.
        reason: Why, and how far off they are; one or two sentences.
        values: Values of parameters in which it holds, by name; of a parameter that is not named, any. None stands for
            a run whose parameters have none of that name, such as one of a scene on a recording.
    """

    trackers: tuple[str, ...]
    reason: str
    values: Mapping[str, tuple[Value | None, ...]] = field(default_factory=dict)

    def holds(self, tracker: str, parameters: Any) -> bool:  # noqa: ANN401 - the experiment's own model
        """Return whether it holds of a tracker with these parameters."""
        return tracker in self.trackers and all(
            getattr(parameters, name, None) in allowed for name, allowed in self.values.items()
        )

    @property
    def setting(self) -> str:
        """The values of parameters in which it holds, in words; empty if it is in all."""
        said = {name: ["none" if it is None else str(it) for it in allowed] for name, allowed in self.values.items()}
        return "; ".join(f"{name} = {' or '.join(allowed)}" for name, allowed in said.items())

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values by name."""
        values = {name: list(allowed) for name, allowed in self.values.items()}
        return {"trackers": list(self.trackers), "values": values, "reason": self.reason}


def reasons(declared: Iterable[Overconfidence], in_force: Iterable[tuple[str, Any]]) -> str:
    """Return the reasons that hold of any of several trackers with their parameters, each once; empty if none does."""
    settings = list(in_force)
    return " ".join(dict.fromkeys(one.reason for one in declared if any(one.holds(*setting) for setting in settings)))
