"""What the sides run: real ROS 2 and callboard's ROS face alike, in one process each."""
