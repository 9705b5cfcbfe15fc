"""Driven robots from data: kinematics, inverse dynamics, output error, the joint estimate."""
