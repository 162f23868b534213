"""Builds the module by CMake, libraries within; in a virtual environment, as Debian's pip asks for:

    python3 -m venv --system-site-packages venv
    venv/bin/pip install --no-build-isolation ./apps/python

Needs what the C++ build needs, and pybind11-dev, python3-dev, python3-numpy, python3-setuptools,
python3-wheel and python3-venv. CIRCLINE_BUILD_DIR names a folder to build in that is to be kept.
"""

import os
import pathlib
import re
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

HERE = pathlib.Path(__file__).resolve().parent
TOP = HERE.parent.parent


class CMakeBuild(build_ext):
    def build_extension(self, ext: Extension) -> None:
        target = pathlib.Path(self.get_ext_fullpath(ext.name)).resolve().parent
        build = pathlib.Path(os.environ.get("CIRCLINE_BUILD_DIR", self.build_temp)).resolve()
        options = {
            "CMAKE_BUILD_TYPE": "Release",
            "BUILD_SHARED_LIBS": "OFF",
            "CIRCLINE_BUILD_BENCHMARKS": "OFF",
            "CIRCLINE_BUILD_TESTS": "OFF",
            "CIRCLINE_BUILD_PYTHON": "ON",
            "Python_EXECUTABLE": sys.executable,
        }
        subprocess.run(
            ["cmake", "-S", TOP, "-B", build, *(f"-D{k}={v}" for k, v in options.items())],
            check=True,
        )
        jobs = str(os.cpu_count() or 1)
        subprocess.run(
            ["cmake", "--build", build, "--target", "circline_python", "-j", jobs], check=True
        )
        self.copy_file(str(next((build / "python/circline").glob("_circline*.so"))), str(target))


version = re.search(r"VERSION ([0-9.]+)", (TOP / "CMakeLists.txt").read_text().split("project(", 1)[1])
assert version is not None
setup(
    name="circline",
    version=version.group(1),
    description="Camera pose from circles and parallel lines in photos",
    license="BSD-3-Clause",
    packages=["circline"],
    package_data={"circline": ["py.typed", "*.pyi"]},
    ext_modules=[Extension("circline._circline", [])],
    cmdclass={"build_ext": CMakeBuild},
    python_requires=">=3.8",
    install_requires=["numpy"],
)
