// Helpers of tests for files and errors.
#pragma once

#include <zlib.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

#include "problems/common/error.h"
#include "tests/common/matchers.h"

namespace trueline {

// The message of the InputError that `action` throws.
inline std::string ErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

inline std::string ReadText(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

// A directory of its own for each test, removed afterwards.
class TestFolder {
 public:
  TestFolder() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    directory_ = std::filesystem::path(testing::TempDir()) /
                 (std::string(test->test_suite_name()) + "_" + test->name());
    std::filesystem::remove_all(directory_);
    std::filesystem::create_directories(directory_);
  }
  ~TestFolder() { std::filesystem::remove_all(directory_); }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return directory_ / name; }
  const std::filesystem::path& directory() const { return directory_; }

 private:
  std::filesystem::path directory_;
};

// A file of the text, packed by gzip.
inline void WriteCompressed(const std::filesystem::path& file, const std::string& text) {
  gzFile out = gzopen(file.c_str(), "wb");
  gzwrite(out, text.data(), static_cast<unsigned>(text.size()));
  gzclose(out);
}

// Where the measured flights are: TRUELINE_DATA, or shared/data beside the source tree.
inline std::filesystem::path DataFolder() {
  const char* folder = std::getenv("TRUELINE_DATA");
  return folder != nullptr ? std::filesystem::path(folder)
                           : std::filesystem::path(TRUELINE_TEST_SOURCE_DIR) / "../shared/data";
}

}  // namespace trueline
