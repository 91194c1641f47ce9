"""What the processes of real ROS 2 run."""
