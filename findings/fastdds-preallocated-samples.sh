#!/usr/bin/env bash
# ros-rclpy 9.1.2 with ros-rmw-fastrtps-cpp 9.3.3 (ROS 2 Kilted, Fast DDS 3.2.3), Python 3.11 on Linux x86-64, seen on
# 2026-11-28.
#
# A service keeps the newest requests that its QoS depth allows.
#
# Guess: a service of depth 500 takes much more memory than one of depth 100, as it keeps five times as many requests, and
#        an XML profile says nothing about services unless RMW_FASTRTPS_USE_QOS_FROM_XML is set.
# Seen: both take the same, some 130 KiB, and one of depth 10 takes 90: Fast DDS sets up to 100 samples aside for each
#       reader and writer, used or not. An XML profile with `allocated_samples` 1 as the default of readers and writers
#       holds for services, too, without that variable: then each takes below 50 KiB, whatever its depth.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rclpy==9.1.2 \
    ros-rmw-fastrtps-cpp==9.3.3 ros-rmw-implementation==3.0.4 ros-std-srvs==5.5.1
cat > "$folder/profile.xml" <<'XML'
<?xml version="1.0" encoding="UTF-8"?>
<profiles>
  <data_writer profile_name="writers" is_default_profile="true">
    <topic><resourceLimitsQos><allocated_samples>1</allocated_samples></resourceLimitsQos></topic>
  </data_writer>
  <data_reader profile_name="readers" is_default_profile="true">
    <topic><resourceLimitsQos><allocated_samples>1</allocated_samples></resourceLimitsQos></topic>
  </data_reader>
</profiles>
XML
cat > "$folder/measure.py" <<'PYTHON'
import re
import sys
from pathlib import Path

import rclpy
from rclpy.qos import QoSProfile
from std_srvs.srv import Trigger


def memory():
    """Return the KiB that are this process's own."""
    return int(re.search(r"Pss:\s+(\d+)", Path("/proc/self/smaps_rollup").read_text())[1])


rclpy.init()
node = rclpy.create_node("server")
profile = QoSProfile(depth=int(sys.argv[1]))
kept = [node.create_service(Trigger, f"warm_{i}", lambda _, r: r, qos_profile=profile) for i in range(20)]
before = memory()
kept += [node.create_service(Trigger, f"s_{i}", lambda _, r: r, qos_profile=profile) for i in range(200)]
print((memory() - before) // 200)
PYTHON
measure() { ROS_LOG_DIR=$folder/log ROS_DOMAIN_ID=87 ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST "$folder/env/bin/python" "$folder/measure.py" "$1"; }
ten=$(measure 10) hundred=$(measure 100) many=$(measure 500)
export FASTDDS_DEFAULT_PROFILES_FILE=$folder/profile.xml
small=$(measure 500)
echo "KiB for a service of depth 10: $ten, 100: $hundred, 500: $many; 500 with the profile: $small"
((ten < hundred && many * 10 < hundred * 11 && small * 2 < ten)) || { echo "It is no longer so." >&2; exit 1; }
