// Skeleton of trueline-export
// AirSim: call this in place of setupFrameGenericQuad of MultiRotorParams. Forward-right-down, from
// the centre of mass. Rotors: front right, rear left (anticlockwise), front left, rear right.
static void setupFrameOfTrueline(msr::airlib::MultiRotorParams::Params& params) {
  using msr::airlib::RotorTurningDirection;
  using msr::airlib::Vector3r;
  params.rotor_count = 4;
  params.mass = 1.0;                              // kg, with motors
  const double motor_assembly_weight = 0.0;       // kg, of one
  params.body_box.x() = 0.1;                      // m, a box with the vehicle's inertia
  params.body_box.y() = 0.1;
  params.body_box.z() = 0.1;
  params.linear_drag_coefficient = 0.0;
  params.rotor_params.propeller_diameter = 0.2;   // m; C_T and C_P follow it
  params.rotor_params.C_T = 1.0;
  params.rotor_params.C_P = 1.0;
  params.rotor_params.max_rpm = 1.0;
  params.rotor_params.control_signal_filter_tc = 1.0;  // s
  params.rotor_params.calculateMaxThrust();
  const Vector3r rotor_0 = Vector3r(0.1, 0.1, 0.0);
  const Vector3r rotor_1 = Vector3r(-0.1, -0.1, 0.0);
  const Vector3r rotor_2 = Vector3r(0.1, -0.1, 0.0);
  const Vector3r rotor_3 = Vector3r(-0.1, 0.1, 0.0);
  const Vector3r up(0, 0, -1);
  params.rotor_poses.clear();
  params.rotor_poses.emplace_back(rotor_0, up, RotorTurningDirection::RotorTurningDirectionCCW);
  params.rotor_poses.emplace_back(rotor_1, up, RotorTurningDirection::RotorTurningDirectionCCW);
  params.rotor_poses.emplace_back(rotor_2, up, RotorTurningDirection::RotorTurningDirectionCW);
  params.rotor_poses.emplace_back(rotor_3, up, RotorTurningDirection::RotorTurningDirectionCW);
  msr::airlib::MultiRotorParams::computeInertiaMatrix(params.inertia, params.body_box,
                                                      params.rotor_poses, params.mass -
                                                      4 * motor_assembly_weight,
                                                      motor_assembly_weight);
}
