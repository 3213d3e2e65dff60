#include "problems/common/link_tree.h"

#include <fcntl.h>
#include <unistd.h>

#include <system_error>
#include <vector>

#include "problems/common/error.h"

namespace trueline {
namespace fs = std::filesystem;
namespace {

bool IsFolder(const fs::path& path) { return fs::is_directory(fs::symlink_status(path)); }

void LinkOrCopy(const fs::path& from, const fs::path& to) {
  if (::linkat(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), 0) == 0) return;
  std::error_code error;
  fs::copy(from, to, fs::copy_options::copy_symlinks, error);
  if (!error) return;
  throw ErrorAt(from.string(), 0,
                fmt::format("cannot be kept beside the new result ({}); make room, or give "
                            "another --out",
                            error.message()));
}

void LinkFolder(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::create_directory(to, from, error);  // with its permissions
  if (error) throw ErrorAt(from.string(), 0, "cannot be kept: " + error.message());
  LinkTree(from, to, {});
}

bool IsSkipped(const fs::path& entry, const std::set<std::string>& skip) {
  return skip.contains(entry.filename().string()) && !IsFolder(entry);
}

std::vector<fs::path> EntriesOf(const fs::path& folder, const std::set<std::string>& skip) {
  std::vector<fs::path> entries;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!IsSkipped(entry.path(), skip)) entries.push_back(entry.path());
  }
  return entries;
}

}  // namespace

void LinkTree(const fs::path& from, const fs::path& to, const std::set<std::string>& skip) {
  for (const fs::path& entry : EntriesOf(from, skip)) {
    const fs::path link = to / entry.filename();
    const bool taken = fs::exists(fs::symlink_status(link));
    if (taken && IsFolder(entry)) {
      throw ErrorAt(entry.string(), 0,
                    "is a folder; a file of this name is to be written: move "
                    "the folder, or give another --out");
    }
    if (taken) continue;
    IsFolder(entry) ? LinkFolder(entry, link) : LinkOrCopy(entry, link);
  }
}

void RemoveLinked(const fs::path& from, const fs::path& to, const std::set<std::string>& skip) {
  std::error_code ignored;
  for (const fs::path& entry : EntriesOf(from, {})) {
    const fs::path link = to / entry.filename();
    if (!fs::exists(fs::symlink_status(link)) && !IsSkipped(entry, skip)) {
      fs::rename(entry, link, ignored);
    } else if (IsFolder(entry) && IsFolder(link)) {
      RemoveLinked(entry, link, {});
    } else {
      fs::remove_all(entry, ignored);
    }
  }
  fs::remove(from, ignored);
}

}  // namespace trueline
