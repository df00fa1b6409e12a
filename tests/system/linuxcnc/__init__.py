"""A real LinuxCNC without display, a virtual axis behind it, and the laser that reads it."""
