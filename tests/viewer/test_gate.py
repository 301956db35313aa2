"""Who may come in."""

import http.client
import http.server
import threading

import pytest

from surgisim.problem import Problem
from surgisim.viewer.gate import Gate, checked_token

TOKEN = "a token of some length"


@pytest.fixture
def behind():
    class Page(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.end_headers()
            self.wfile.write(b"the page")

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Page)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server.server_port
    server.shutdown()


def asked(gate, path="/", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", gate.port, timeout=5)
    connection.request("GET", path, headers={k.replace("_", "-"): v for k, v in headers.items()})
    answer = connection.getresponse()
    return answer.status, answer.read().decode(), answer.headers


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.7", "::", "lab-machine"])
def test_the_network_is_not_let_in_without_a_token(host):
    with pytest.raises(Problem, match="no token is set"):
        checked_token(host, None)
    with pytest.raises(Problem, match="at least 16"):
        checked_token(host, "short")
    assert checked_token(host, TOKEN) == TOKEN
    assert checked_token("127.0.0.1", None) is None


def test_a_visitor_without_the_token_is_refused_and_one_with_it_keeps_it_as_a_cookie(behind):
    gate = Gate("127.0.0.1", 0, behind, TOKEN)
    for headers in ({}, {"Cookie": "surgisim=something else"}, {"Upgrade": "websocket"}):
        status, words, _ = asked(gate, **headers)
        assert status == 401
        assert "A token is wanted" in words
    status, _, headers = asked(gate, f"/?token={TOKEN.replace(' ', '%20')}")
    assert (status, headers["Location"]) == (303, "/")
    assert "HttpOnly" in headers["Set-Cookie"]
    assert "SameSite=Strict" in headers["Set-Cookie"]
    assert asked(gate, Cookie=f'surgisim="{TOKEN}"')[:2] == (200, "the page")
    gate.close()


def test_another_page_in_the_same_browser_may_not_talk_to_it(behind):
    gate = Gate("127.0.0.1", 0, behind, None)
    own = f"localhost:{gate.port}"
    assert asked(gate, Host=own)[:2] == (200, "the page")
    assert asked(gate, Host=own, Origin=f"http://{own}")[0] == 200
    assert asked(gate, Host=own, Origin="http://elsewhere.example")[0] == 403
    assert asked(gate, Host="elsewhere.example")[0] == 403
    gate.close()


def test_a_taken_port_is_said(behind):
    with pytest.raises(Problem, match="cannot be bound"):
        Gate("127.0.0.1", behind, behind, None)
