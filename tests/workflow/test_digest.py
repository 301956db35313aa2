"""Which files count as a stage's code."""

import pytest

from surgisim.digest import digest, sources


@pytest.fixture
def project(tmp_path):
    def write(**files):
        for name, text in files.items():
            path = tmp_path / (name.replace("__", "/") + ".py")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            for folder in path.relative_to(tmp_path).parents:
                if folder.parts and folder.parts[0] == "surgisim":
                    (tmp_path / folder / "__init__.py").touch()
        found = sources(tmp_path / "stage.py", tmp_path)
        return {str(p.relative_to(tmp_path)) for p in found if p.name not in ("__init__.py", "stage.py")}

    return write


def test_an_import_inside_a_function_counts(project):
    assert project(stage="def f():\n    from surgisim.a import x", surgisim__a="") == {"surgisim/a.py"}


def test_imports_of_imports_count_and_circles_end(project):
    files = {
        "stage": "import surgisim.a",
        "surgisim__a": "from surgisim.b import c",
        "surgisim__b": "import surgisim.a",
    }
    assert project(**files) == {"surgisim/a.py", "surgisim/b.py"}


def test_a_neighbour_that_nobody_imports_does_not_count(project):
    files = {"stage": "from surgisim.room.a import x", "surgisim__room__a": "", "surgisim__room__b": ""}
    assert project(**files) == {"surgisim/room/a.py"}


def test_a_folder_imported_to_be_scanned_counts_whole(project):
    files = {"stage": "from surgisim.room import terms", "surgisim__room__terms__a": "", "surgisim__room__terms__b": ""}
    assert project(**files) == {"surgisim/room/terms/a.py", "surgisim/room/terms/b.py"}


def test_a_module_named_in_a_string_counts(project):
    files = {"stage": "import_module(f'surgisim.room.{name}')", "surgisim__room__a": "", "surgisim__room__b": ""}
    assert project(**files) == {"surgisim/room/a.py", "surgisim/room/b.py"}


def test_a_relative_import_counts(project):
    files = {"stage": "import surgisim.room.a", "surgisim__room__a": "from .b import x", "surgisim__room__b": ""}
    assert "surgisim/room/b.py" in project(**files)


def test_a_page_template_beside_a_module_counts(project, tmp_path):
    project(stage="import surgisim.room.a", surgisim__room__a="")
    before = digest(tmp_path / "stage.py", tmp_path)
    (tmp_path / "surgisim" / "room" / "page.j2").write_text("<p>")
    assert digest(tmp_path / "stage.py", tmp_path) != before
