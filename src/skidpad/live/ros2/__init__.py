"""ROS 2 topics without ROS: the same bytes over DDS. Byte-compatible, untried with ROS itself."""
