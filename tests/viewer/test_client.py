"""viser's client page, prepared to live inside a session's page."""

import viser

from server.viewer import CONTENT_SECURITY_POLICY, client_page


def test_our_script_runs_before_visers() -> None:
    """Theme and address have to be settled before the client reads them."""
    page = client_page().decode()
    assert page.index("pftrack-viser") < page.index("data-p=")
    assert "<title>pftrack scene</title>" in page


def test_the_client_is_the_one_of_the_server() -> None:
    """Both come from the same installation, so their versions agree."""
    assert viser.__version__.startswith("1.1.")
    assert len(client_page()) > 500_000


def test_the_policy_allows_no_evaluation_and_no_other_host() -> None:
    """A page that is led astray by `?websocket=` cannot connect."""
    assert "'unsafe-eval'" not in CONTENT_SECURITY_POLICY.replace("'wasm-unsafe-eval'", "")
    assert "connect-src 'self' data: blob:;" in CONTENT_SECURITY_POLICY
    assert "http" not in CONTENT_SECURITY_POLICY
