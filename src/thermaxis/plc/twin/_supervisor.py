"""The supervisor once more, plainly, in the numbers of the target.

Written from the table in ``docs/theory/supervisor.md``, row by row.
"""

from typing import NamedTuple, final

from thermaxis.compensation import Reason, SupervisorRules, SupervisorState
from thermaxis.plc.twin._numbers import Rounding

_OFF, _WARMING, _ACTIVE, _HOLDING, _FADING, _FAULT = SupervisorState
_MOST_S = 1e9


class Now(NamedTuple):
    """What is so in a call."""

    inputs_usable: bool
    """Whether every input has a usable value and the time went on."""
    model_runs: bool
    """Whether the model neither waits nor has just started."""
    connected: bool
    """Whether the machine can be written to."""
    interlocks_met: bool
    """Whether every interlock is met."""
    agrees: bool
    """Whether the machine reports what was written."""
    at_limit: bool
    """Whether the model asks for more than a magnitude allows."""
    other: bool
    """Whether another compensation is active."""
    outside: bool
    """Whether a correction in force lies outside its total."""
    at_zero: bool
    """Whether every correction in force is zero."""


@final
class SupervisorTwin:
    """Decides in which state the compensation is, from call to call.

    Not protected: it believes its signals.
    """

    def __init__(self, rules: SupervisorRules, cycle_s: float, rounded: Rounding) -> None:
        r = self._r = rounded
        self._cycle_s = r(cycle_s)
        self._settle_s, self._recovery_delay_s = r(rules.settle_s), r(rules.recovery_delay_s)
        self._input_timeout_s = r(rules.input_timeout_s)
        self._hold_input_s = r(rules.input_timeout_s + rules.hold_input_s)
        self._hold_connection_s = r(rules.hold_connection_s)
        self._hold_interlock_s = r(rules.hold_interlock_s)
        self._hold_operator_s = r(rules.hold_operator_s)
        self._read_back_s, self._at_limit_s = r(rules.read_back_s), r(rules.at_limit_s)
        holds_s = (
            rules.hold_input_s,
            rules.hold_connection_s,
            rules.hold_interlock_s,
            rules.hold_operator_s,
        )
        self._max_hold_s = r(
            rules.settle_s + rules.recovery_delay_s + rules.input_timeout_s + max(holds_s)
        )
        self.state = _OFF
        self.enabled = False
        self.held = False
        self._fault: Reason | None = None
        self._running_s = self._ready_s = 0.0
        self._input_lost_s = self._connection_lost_s = self._interlock_open_s = 0.0
        self._held_s = self._differs_s = self._limited_s = self._halted_s = 0.0

    # ---- requests ------------------------------------------------------------------------------

    def enable(self, *, other: bool, outside: bool) -> bool:
        """Answer a request to enable it."""
        if self.state is _FAULT or other or outside:
            return False
        if not self.enabled:
            self.enabled, self.held, self._ready_s = True, False, 0.0
        return True

    def disable(self) -> bool:
        """Answer a request to disable it, which always takes effect."""
        self.enabled = self.held = False
        return True

    def hold(self) -> bool:
        """Answer a request to hold it; return whether there is something to hold."""
        if not self.enabled or self.state is _FAULT:
            return False
        if not self.held:
            self.held, self._held_s = True, 0.0
        return True

    def resume(self) -> bool:
        """Answer a request to end a hold, which always takes effect."""
        self.held = False
        return True

    def acknowledge(self, now: Now) -> bool:
        """Answer a request to acknowledge."""
        if self.state is not _FAULT:
            return True
        stands = {
            Reason.DOUBLE_COMPENSATION: now.other,
            Reason.OFFSET_OUTSIDE: now.outside,
            Reason.READ_BACK_DIFFERS: not (now.agrees and now.connected),
        }
        if self._fault is not None and stands.get(self._fault, False):
            return False
        self.state, self._fault = _FADING, None
        self.enabled = self.held = False
        self._differs_s = 0.0
        return True

    # ---- the call ------------------------------------------------------------------------------

    def advance(self, now: Now) -> tuple[Reason, ...]:
        """Count the times on by a cycle and take one row of the table."""
        self._count(now)
        if self.state is _FAULT:
            return (self._fault or Reason.OFFSET_OUTSIDE,)
        reasons, expired = self._blocked()
        if self.state is not _OFF:
            fault = self._fault_of(now)
            if fault is not None:
                self.state, self._fault = _FAULT, fault
                return (fault,)
        self.state = self._next(now, blocked=bool(reasons), expired=expired)
        if self.state is _ACTIVE:
            return ()
        if not self.enabled:
            return (Reason.DISABLED,)
        return reasons or (Reason.HEALING,)

    def _count(self, now: Now) -> None:
        r, cycle_s = self._r, self._cycle_s

        def counted(before_s: float, *, on: bool, first_s: float = cycle_s) -> float:
            if not on:
                return 0.0
            return min(r(before_s + (cycle_s if before_s else min(cycle_s, first_s))), _MOST_S)

        ready = now.inputs_usable and now.connected and now.interlocks_met and now.model_runs
        watched = self.state is not _OFF and now.connected
        at_work = self.state in {_ACTIVE, _HOLDING}
        halted = self.enabled and self.state in {_WARMING, _HOLDING, _FADING}
        self._running_s = min(counted(self._running_s, on=now.model_runs), self._settle_s)
        self._ready_s = min(counted(self._ready_s, on=ready), self._recovery_delay_s)
        self._input_lost_s = counted(self._input_lost_s, on=not now.inputs_usable)
        self._connection_lost_s = counted(self._connection_lost_s, on=not now.connected)
        self._interlock_open_s = counted(self._interlock_open_s, on=not now.interlocks_met)
        self._held_s = counted(self._held_s, on=self.held)
        self._differs_s = counted(
            self._differs_s, on=watched and not now.agrees, first_s=self._read_back_s
        )
        self._limited_s = counted(
            self._limited_s, on=at_work and now.at_limit, first_s=self._at_limit_s
        )
        self._halted_s = counted(self._halted_s, on=halted)

    def _fault_of(self, now: Now) -> Reason | None:
        """Return the gravest fault."""
        if now.other:
            return Reason.DOUBLE_COMPENSATION
        if self._differs_s > self._read_back_s:
            return Reason.READ_BACK_DIFFERS
        if now.outside:
            return Reason.OFFSET_OUTSIDE
        if self._limited_s > self._at_limit_s:
            return Reason.LONG_AT_LIMIT
        return None

    def _blocked(self) -> tuple[tuple[Reason, ...], bool]:
        """Return what keeps it from being active, and whether that has lasted for too long."""
        longest = (
            (Reason.CONNECTION_LOST, self._connection_lost_s, 0.0, self._hold_connection_s),
            (Reason.INTERLOCK_OPEN, self._interlock_open_s, 0.0, self._hold_interlock_s),
            (Reason.INPUT_BAD, self._input_lost_s, self._input_timeout_s, self._hold_input_s),
        )
        reasons = [reason for reason, lost_s, bridged_s, _ in longest if lost_s > bridged_s]
        expired = any(
            lost_s > bridged_s and lost_s > most_s for _, lost_s, bridged_s, most_s in longest
        )
        if self._running_s < self._settle_s:
            reasons.append(Reason.SETTLING)
        if self.held:
            too_long = self._held_s > self._hold_operator_s
            reasons.append(Reason.HOLD_EXPIRED if too_long else Reason.OPERATOR_HOLD)
            expired = expired or too_long
        return tuple(reasons), expired or self._halted_s > self._max_hold_s

    def _next(self, now: Now, *, blocked: bool, expired: bool) -> SupervisorState:
        """Return the state of this call: the table's rows, faults apart."""
        state = self.state
        known_zero = now.at_zero and now.connected
        if not self.enabled:
            return _OFF if state is _OFF or known_zero else _FADING
        if state is _OFF:
            return _WARMING
        healed = not blocked and self._ready_s >= self._recovery_delay_s
        if healed or (state is _ACTIVE and not blocked):
            return _ACTIVE
        if state is _FADING:
            return _WARMING if known_zero else _FADING
        if state is _WARMING:
            return _FADING if expired and not now.at_zero else _WARMING
        return _FADING if expired else _HOLDING
