"""Puts the `.pth` file beside the module: setuptools has no option for it."""

from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

PTH = "callboard_ros.pth"


class BuildWithPth(build_py):
    """Copies the `.pth` file to the root of the distribution, which becomes site-packages."""

    def run(self) -> None:
        """Build."""
        super().run()
        self.copy_file(PTH, str(Path(self.build_lib, PTH)))

    def get_outputs(self, include_bytecode: int = 1) -> list[str]:
        """Return what has been built."""
        return [*super().get_outputs(include_bytecode), str(Path(self.build_lib, PTH))]


setup(cmdclass={"build_py": BuildWithPth})
