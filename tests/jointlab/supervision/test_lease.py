"""The control lease: one driver at a time, for as long as it is renewed."""

import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jointlab.drive.endpoint import NoDriveError
from jointlab.errors import ConflictError
from jointlab.supervision.lease import DURATION, ControlLease, ForeignLeaseError, LeaseError
from tests.clock import Clock


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def drivers() -> list[str | None]:
    return []


@pytest.fixture
def lease(clock: Clock, drivers: list[str | None]) -> ControlLease:
    return lease_of(drivers, clock)


def lease_of(drivers: list[str | None], clock: Clock) -> ControlLease:
    """A lease whose numbers count who drove before."""

    def let_drive(holder: str | None, by_force: bool) -> int:
        drivers.append(f"{holder} by force" if by_force else holder)
        return len(drivers)

    return ControlLease(let_drive, clock)


def test_it_ends_by_itself_unless_it_is_renewed(lease: ControlLease, clock: Clock) -> None:
    held = lease.take("page", "key 1")
    clock.now += DURATION - 1
    lease.renew(held.token)
    clock.now += DURATION - 1
    lease.check(held.token)
    clock.now += 2
    assert lease.holder is None
    with pytest.raises(LeaseError, match="nobody drives the rig"):
        lease.check(held.token)
    with pytest.raises(LeaseError, match="nobody drives the rig"):
        lease.renew(held.token)


def test_what_has_ended_by_itself_is_told_once(clock: Clock) -> None:
    told = list[float]()
    lease = ControlLease(lambda *_: 7, clock, ended=lambda: told.append(clock.now))
    lease.give_back_ended()  # nobody has driven
    token = lease.take("page", "key 1").token
    lease.give_back_ended()
    clock.now += DURATION
    for _ in range(2):
        lease.give_back_ended()
    assert told == [clock.now]
    assert lease.hold(token, "page", "key 1").number == 7  # the same client may take it again
    lease.take("page", "key 1", by_force=True, lasts=math.inf)
    clock.now += 1e9
    lease.give_back_ended()
    assert lease.holder == "page"
    assert len(told) == 1


def test_what_could_not_be_told_is_told_later(clock: Clock) -> None:
    answers = iter((NoDriveError("away"), None))

    def ended() -> None:
        if (error := next(answers)) is not None:
            raise error

    lease = ControlLease(lambda *_: 7, clock, ended=ended)
    lease.take("page", "key 1")
    clock.now += DURATION
    for _ in range(3):
        lease.give_back_ended()
    assert next(answers, "told") == "told"


def test_no_other_client_drives_meanwhile(lease: ControlLease, clock: Clock) -> None:
    lease.take("page", "key 1")
    clock.now += 10
    with pytest.raises(LeaseError, match=r"page drives the rig for another 50 s or longer$"):
        lease.take("script", "key 2")
    for token in (None, "", "guess", "ü"):
        with pytest.raises(LeaseError, match="page drives the rig"):
            lease.check(token)


def test_it_can_be_taken_by_force_and_the_former_driver_is_out(lease: ControlLease, drivers: list[str | None]) -> None:
    former = lease.take("page", "key 1")
    latter = lease.take("engineer", "key 2", by_force=True, from_others=True)
    lease.check(latter.token)
    with pytest.raises(LeaseError, match="engineer drives the rig"):
        lease.check(former.token)
    lease.release(latter.token)
    assert drivers == ["page", "engineer by force", None]


def test_another_program_gives_way_to_an_engineer_alone(lease: ControlLease, drivers: list[str | None]) -> None:
    lease.take("script", "key 1")
    lease.take("page", "key 1", by_force=True)
    assert drivers == ["script", "page"]
    lease.take("page", "key 2", by_force=True, from_others=True)
    assert drivers[2:] == ["page by force"]


def test_a_second_client_of_one_key_learns_who_drives_and_takes_over_by_force(lease: ControlLease) -> None:
    first = lease.take("page", "key 1")
    with pytest.raises(LeaseError, match=r"page drives the rig .*; it uses your key, so you may take over"):
        lease.take("page", "key 1")
    second = lease.take("page", "key 1", by_force=True)
    lease.check(second.token)
    with pytest.raises(LeaseError, match="page drives the rig"):
        lease.check(first.token)


def test_a_client_of_another_key_takes_over_only_where_it_may_from_others(
    lease: ControlLease, drivers: list[str | None]
) -> None:
    held = lease.take("page", "key 1")
    with pytest.raises(ForeignLeaseError, match="only a key with the scope engineer can take it over from another key"):
        lease.take("script", "key 2", by_force=True)
    lease.check(held.token)
    assert drivers == ["page"]


def test_a_client_with_a_token_of_its_own_goes_on_and_another_one_is_refused(
    lease: ControlLease, clock: Clock, drivers: list[str | None]
) -> None:
    lease.hold("tab 1", "page", "key 1")
    clock.now += DURATION - 1
    lease.hold("tab 1", "page", "key 1")
    clock.now += DURATION - 1
    assert lease.keep("tab 1")
    assert not lease.keep("tab 2")
    with pytest.raises(LeaseError, match="it uses your key, so you may take over"):
        lease.hold("tab 2", "page", "key 1")
    assert drivers == ["page"]
    clock.now += DURATION
    assert not lease.keep("tab 1")
    lease.hold("tab 2", "page", "key 1")
    with pytest.raises(LeaseError, match="page drives the rig"):
        lease.check("tab 1")


def test_a_holder_who_does_not_get_the_lease_of_another_drive_process_drives_no_more(clock: Clock) -> None:
    refused = list[bool]()

    def let_drive(_holder: str | None, _by_force: bool) -> int:
        if refused:
            raise ConflictError("bob drives the rig from another program")
        return 5

    lease = ControlLease(let_drive, clock)
    held = lease.take("alice", "key 1")
    refused.append(True)
    with pytest.raises(ConflictError, match="bob drives"):
        lease.take_again(5)
    assert lease.holder is None
    with pytest.raises(LeaseError, match="nobody drives the rig"):
        lease.check(held.token)


@given(st.lists(st.tuples(st.sampled_from(["take", "renew", "release", "wait"]), st.integers(0, 2)), max_size=40))
def test_however_often_the_holder_changes_at_most_one_token_is_valid(requests: list[tuple[str, int]]) -> None:
    clock = Clock()
    lease, tokens = lease_of([], clock), ["none", "none", "none"]
    actions: dict[str, Callable[[int], object]] = {
        "take": lambda who: lease.take(str(who), "key 1").token,
        "renew": lambda who: lease.renew(tokens[who]).token,
        "release": lambda who: lease.release(tokens[who]),
    }
    for request, who in requests:
        if request == "wait":
            clock.now += DURATION / 2
            continue
        try:
            made = actions[request](who)
        except LeaseError:
            continue
        if isinstance(made, str):
            tokens[who] = made
    good = [who for who in range(3) if _is_good(lease, tokens[who])]
    assert [str(who) for who in good] == ([] if lease.holder is None else [lease.holder])


def _is_good(lease: ControlLease, token: str) -> bool:
    try:
        lease.check(token)
    except LeaseError:
        return False
    return True
