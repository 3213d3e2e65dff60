// Another project's use of the installed library: headers found, symbols linked, files found.
#include <Eigen/Core>
#include <cstdio>

#include "problems/common/app.h"
#include "problems/common/strict_yaml.h"

int main() {
  const trueline::YamlMap map(YAML::Load("{offset: [1, 2, 3]}"), "consumer.yaml", "");
  const Eigen::Vector3d offset = map.GetVector3("offset");
  std::printf("version %s, sum %g\n", trueline::Version().c_str(), offset.sum());
  return 0;
}
