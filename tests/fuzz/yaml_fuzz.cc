// Strict YAML and what is read with it: a column map, and a configuration of a simulated flight.
#include "problems/common/error.h"
#include "problems/common/strict_yaml.h"
#include "problems/import/import_map.h"
#include "problems/simulation/config.h"
#include "tests/fuzz/fuzz_file.h"

namespace {

template <class Read>
void Try(const Read& read) {
  try {
    read();
  } catch (const trueline::InputError&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const trueline::FuzzFile file("file.yaml");
  file.Write(data, size);
  Try([] { trueline::ReadImportMap(file.path()); });
  Try([] { trueline::ReadSimulationConfig(trueline::YamlMap::FromFile(file.path())); });
  return 0;
}
