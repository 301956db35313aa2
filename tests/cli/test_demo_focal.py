"""The embedded clip passes the focal length that it was filmed with."""

from typer.testing import CliRunner

from surgisim import cli


def asked(monkeypatch, *arguments):
    seen = {}
    monkeypatch.setattr(cli, "run", lambda **given: seen.update(given))
    result = CliRunner().invoke(cli.app, ["demo", *arguments])
    assert result.exit_code == 0, result.output
    return seen["set_"]


def test_the_embedded_clip_tells_its_focal_length(monkeypatch):
    assert asked(monkeypatch) == ["focal=192"]


def test_what_is_set_by_hand_comes_after(monkeypatch):
    assert asked(monkeypatch, "--set", "focal=150") == ["focal=192", "focal=150"]


def test_another_camera_is_not_said_to_be_this_one(monkeypatch):
    assert asked(monkeypatch, "--set", "phantom.width=320") == ["phantom.width=320"]
