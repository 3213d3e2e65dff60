// Foreign files and maps for tests of the importer.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "problems/common/error.h"
#include "problems/import/convert.h"

namespace trueline {

inline std::string ErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

// A directory of its own for each test, removed afterwards.
class ImportFiles {
 public:
  ImportFiles() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    directory_ = std::filesystem::path(testing::TempDir()) /
                 (std::string(test->test_suite_name()) + "_" + test->name());
    std::filesystem::remove_all(directory_);
    std::filesystem::create_directories(directory_);
  }
  ~ImportFiles() { std::filesystem::remove_all(directory_); }
  ImportFiles(const ImportFiles&) = delete;
  ImportFiles& operator=(const ImportFiles&) = delete;

  std::string Write(const std::string& name, const std::string& text) const {
    std::ofstream(directory_ / name, std::ios::binary) << text;
    return (directory_ / name).string();
  }
  FlightLog Convert(const std::string& map, const std::string& csv,
                    const ConvertOptions& options = {}) const {
    return ConvertLog(ReadImportMap(Write("map.yaml", map)), {Write("log.csv", csv)}, options);
  }
  std::string Error(const std::string& map, const std::string& csv) const {
    return ErrorOf([&] { Convert(map, csv); });
  }

 private:
  std::filesystem::path directory_;
};

// Where the measured flights are: TRUELINE_DATA, or shared/data beside the source tree.
inline std::filesystem::path DataFolder() {
  const char* folder = std::getenv("TRUELINE_DATA");
  return folder != nullptr ? std::filesystem::path(folder)
                           : std::filesystem::path(TRUELINE_TEST_SOURCE_DIR) / "../shared/data";
}

}  // namespace trueline
