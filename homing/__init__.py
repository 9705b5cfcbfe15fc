"""Where an underactuated robot stands when it is switched on, from incremental encoders."""
