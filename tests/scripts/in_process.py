"""Scripts run in the test's process, where what takes long to load is loaded once."""
import contextlib
import io
import runpy
from types import SimpleNamespace
from unittest import mock


def run(script, *flags):
    """Exit code and what was said, as of a process."""
    code = 0
    with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.redirect_stderr(io.StringIO()) as complained, \
            mock.patch("sys.argv", [str(script), *flags]):
        try:
            runpy.run_path(str(script), run_name="__main__")
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
            if isinstance(end.code, str):
                complained.write(end.code)
    return SimpleNamespace(returncode=code, stdout=said.getvalue(), stderr=complained.getvalue())
