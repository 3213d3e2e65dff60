// Foreign files and maps for tests of the importer.
#pragma once

#include <fstream>
#include <string>
#include <vector>

#include "problems/import/convert.h"
#include "tests/common/test_files.h"

namespace trueline {

inline std::string ShippedMapFile(const std::string& name) {
  return std::string(TRUELINE_TEST_SOURCE_DIR) + "/config/import/" + name + ".yaml";
}
inline ImportMap ShippedMap(const std::string& name) { return ReadImportMap(ShippedMapFile(name)); }

class ImportFiles : public TestFolder {
 public:
  std::string Write(const std::string& name, const std::string& text) const {
    std::ofstream(*this / name, std::ios::binary) << text;
    return (*this / name).string();
  }
  FlightLog Convert(const std::string& map, const std::string& csv,
                    const ConvertOptions& options = {}) const {
    return ConvertLog(ReadImportMap(Write("map.yaml", map)), {Write("log.csv", csv)}, options);
  }
  std::string Error(const std::string& map, const std::string& csv) const {
    return ErrorOf([&] { Convert(map, csv); });
  }
};

}  // namespace trueline
