import json

from hypothesis import given
from hypothesis import strategies as st

from lippmann.client.stream import ServerEvent, parse_events
from service.events.sse import encode

DATA = st.dictionaries(st.text(max_size=8), st.integers() | st.text(max_size=8), max_size=3)


@given(st.lists(st.tuples(st.integers(1, 10**9), st.sampled_from(["job", "task", "frame"]), DATA), max_size=5))
def test_what_the_service_writes_is_what_the_client_reads(events: list[tuple[int, str, dict[str, object]]]) -> None:
    text = "".join(encode(number, kind, json.dumps(data)).decode() for number, kind, data in events)
    # as HTTP lines end: only \n, \r\n and \r, which JSON does not leave bare
    read = list(parse_events(text.split("\n")))
    assert read == [ServerEvent(type=kind, data=data, id=str(number)) for number, kind, data in events]


def test_comments_and_events_without_data_are_passed_over() -> None:
    assert list(parse_events([": alive", "", "event: job", "", "id: 3", ": here", ""])) == []


def test_an_id_without_data_is_remembered_for_the_next_event() -> None:
    (event,) = parse_events(["id: 3", ": here", "", "event: job", "data: 1", ""])
    assert event.id == "3"


def test_data_over_several_lines_is_one() -> None:
    (event,) = parse_events(["data: [1,", "data:2]", ""])
    assert event.data == json.loads("[1,\n2]")


def test_an_event_that_broke_off_is_not_told() -> None:
    assert list(parse_events(["event: job", 'data: {"id": 1}'])) == []
