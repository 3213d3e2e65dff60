// An exclusive lock on a file or folder, which ends with the process however the process ends.
#pragma once

#include <filesystem>

namespace trueline {

class FileLock {
 public:
  FileLock() = default;  // locks nothing
  // Locks an existing path; without `wait` a path that another process holds is not locked. A file
  // system without locks counts as locked.
  FileLock(const std::filesystem::path& path, bool wait);
  ~FileLock();
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;

  bool locked() const { return descriptor_ >= 0; }
  // Whether `path` still is what was locked: another process may have renamed or removed it.
  bool Holds(const std::filesystem::path& path) const;

 private:
  int descriptor_ = -1;
};

}  // namespace trueline
