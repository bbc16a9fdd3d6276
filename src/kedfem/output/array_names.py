"""What arrays in files for ParaView are called, each with its unit."""

STRESS, VON_MISES, DISPLACEMENT = "stress [Pa]", "von Mises [Pa]", "displacement [m]"
LARGEST, SMALLEST = "largest principal stress [Pa]", "smallest principal stress [Pa]"
VELOCITY, ACCELERATION = "velocity [m/s]", "acceleration [m/s^2]"
FORCE, MOMENT = "force [N]", "moment [N m]"
DRIVE_FORCE, DRIVE_TORQUE = "drive force [N]", "drive torque [N m]"
JOINTS = "joints"  # the block of points with what joints exert
