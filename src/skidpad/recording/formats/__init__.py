"""Formats of others: ROS 2 bags and ASAM OSI."""
