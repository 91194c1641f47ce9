"""The programs as a package for ROS 2: `pip install examples/rclpy`."""

from glob import glob

from setuptools import setup

PACKAGE = "course_package"
PROGRAMS = (
    "minimal_publisher",
    "minimal_subscriber",
    "publishing_subscriber",
    "add_two_ints_server",
    "add_two_ints_client",
)

setup(
    name=PACKAGE,
    version="0.1.0",
    package_dir={PACKAGE: "."},
    packages=[PACKAGE],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/launch", glob("launch/*")),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    entry_points={"console_scripts": [f"{name} = {PACKAGE}.{name}:main" for name in PROGRAMS]},
)
