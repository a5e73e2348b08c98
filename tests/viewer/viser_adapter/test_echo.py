"""An echo is asked of a browser in viser's own words, without a thread that waits for it."""

import asyncio
import dataclasses
import inspect
import threading

import viser
from viser import _messages, _viser

from pftrack_server.viewer import viser_adapter
from tests.viewer.host import Peer, Session, wait_for


def echo(session: Session, patience_s: float) -> bool:
    """Ask the browser of a session."""
    server = session.viewer._server
    (client,) = server.get_clients().values()
    return asyncio.run_coroutine_threadsafe(viser_adapter.echo(client, patience_s), server.get_event_loop()).result(10)


def test_viser_asks_in_these_words() -> None:
    """By a message with a key and a name for the answer, which a handler of the connection hears."""
    fields = [field.name for field in dataclasses.fields(_messages.LocalStorageGetItemRequestMessage)]
    assert fields == ["key", "request_uuid"], f"viser {viser.__version__} asks by {fields}; see viser_adapter.echo"
    source = inspect.getsource(_viser.LocalStorageHandle.get_item)
    for words in (
        "_websock_connection.register_handler(",
        "_websock_connection.queue_message(",
        "message.request_uuid != request_uuid",
        "_client.flush()",
    ):
        assert words in source, f"viser {viser.__version__} asks without {words}; see viser_adapter.echo"


def test_a_browser_answers(session: Session, peer: Peer) -> None:
    """Each answer belongs to its own question, and no thread waits for it."""
    before = threading.active_count()
    assert [echo(session, 5.0) for _ in range(3)] == [True] * 3
    assert peer.asked == 3
    (client,) = session.viewer._server.get_clients().values()
    handlers = client._websock_connection._incoming_handlers[_messages.LocalStorageGetItemResponseMessage]
    assert handlers == []  # thousands of questions would leave as many that listen
    assert threading.active_count() <= before


def test_a_browser_that_is_silent_is_given_up(session: Session, peer: Peer) -> None:
    """What it answers too late is the answer to nothing that is asked afterwards."""
    peer.echo = False
    assert not echo(session, 0.05)
    peer.answer()
    assert not echo(session, 0.05)
    peer.echo = True
    assert echo(session, 5.0)


def test_one_that_has_left_is_not_asked(session: Session, peer: Peer) -> None:
    """The question would not be heard, as viser would warn."""
    server = session.viewer._server
    (client,) = server.get_clients().values()
    peer.close()
    wait_for(lambda: viser_adapter.connection_of(client) is None)
    asking = viser_adapter.echo(client, 5.0)
    assert not asyncio.run_coroutine_threadsafe(asking, server.get_event_loop()).result(1)
