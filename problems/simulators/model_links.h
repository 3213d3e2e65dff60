// Mass, centre and inertia of a vehicle that is a model of links (SDF, URDF): all count.
#pragma once

#include "problems/simulators/vehicle_file.h"

namespace trueline {

// Adds the sums to file->vehicle, and readings of the heaviest link, which a correction changes.
// Link poses are in the model's frame (SDF) or follow the joints (URDF).
void AddLinks(VehicleFile* file);

}  // namespace trueline
