# Skeleton of trueline-export
# Isaac Lab (isaaclab_contrib): VEHICLE is the asset, of a USD file with links rotor_0 to rotor_3:
# front right, rear left, front left, rear right. Forward-left-up, from the centre of mass.
# Once the simulation runs, set_body(robot) puts in what the USD file may state otherwise.
import isaaclab.sim as sim_utils
import torch
from isaaclab_contrib.actuators import ThrusterCfg
from isaaclab_contrib.assets import MultirotorCfg

MASS = 1.0  # kg
INERTIA = [1.0, 1.0, 1.0]  # kg m^2

THRUSTER = ThrusterCfg(
    thruster_names_expr=["rotor_0", "rotor_1", "rotor_2", "rotor_3"],
    thrust_range=(0.0, 1.0),  # N
    thrust_const_range=(1.0, 1.0),  # N/(rev/s)^2; equal: nothing is drawn
    tau_inc_range=(0.1, 0.1),  # s
    tau_dec_range=(0.1, 0.1),  # s
    torque_to_thrust_ratio=1.0,  # m
    use_discrete_approximation=False,
)

VEHICLE = MultirotorCfg(
    spawn=sim_utils.UsdFileCfg(
        usd_path="vehicle.usd",
        rigid_props=sim_utils.RigidBodyPropertiesCfg(linear_damping=0.0, angular_damping=0.0),
    ),
    actuators={"thrusters": THRUSTER},
    allocation_matrix=[
        [0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0],
        [1.0, 1.0, 1.0, 1.0],
        [-0.1, 0.1, 0.1, -0.1],
        [-0.1, 0.1, -0.1, 0.1],
        [-0.01, -0.01, 0.01, 0.01],
    ],
    rotor_directions=[1, 1, -1, -1],  # 1: anticlockwise from above
)


def set_body(robot):
    """Mass and inertia of all of `robot`, on its first body."""
    view, index = robot.root_physx_view, torch.arange(robot.num_instances)
    masses, inertias = view.get_masses(), view.get_inertias()
    masses[:], inertias[:] = 1e-6 * MASS, 0.0
    masses[:, 0] = MASS
    inertias[:, 0, [0, 4, 8]] = torch.tensor(INERTIA)
    view.set_masses(masses, index)
    view.set_inertias(inertias, index)
