// A result folder that changes as one: all files of a run, or none.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace trueline {

// manifest.yaml of a result folder: which program wrote which files, with their digests.
inline constexpr char kManifestFile[] = "manifest.yaml";

struct Manifest {
  std::string program;             // "trueline-calibrate"
  std::vector<std::string> files;  // names without folders
};

// Lists every file in `folder`: its name and the SHA-256 of its bytes.
void WriteManifest(const std::filesystem::path& folder, const std::string& program);

// Empty where there is no manifest, or one that no program of Trueline wrote.
Manifest ReadManifest(const std::filesystem::path& folder);

// An exclusive lock on a file or folder, which ends with the process however the process ends.
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

// A run writes its files in path(), a hidden folder beside `out` (`.OUT.part-...`). Commit() puts
// it in the place of `out` by one exchange of two names, so whoever kills the run at any moment
// finds the old result or the new one. Files in `out` that no run has written stay. Where the
// folder can't be exchanged (a mount point, the working folder, or nothing may be made beside it)
// the files are renamed one after the other; manifest.yaml leaves first and comes last, so a folder
// without it was interrupted.
//
// manifest.yaml lists the files of the run with their digests. The next run removes those that it
// does not write itself.
class ResultFolder {
 public:
  // program: stated in the manifest. Throws InputError if `out` can't be written, before the work.
  ResultFolder(const std::filesystem::path& out, const std::string& program);
  // A native log: no manifest; Commit() removes those of the `owned` files that were not written.
  ResultFolder(const std::filesystem::path& out, const std::vector<std::string>& owned);
  ~ResultFolder();  // Without Commit() the old result stays, and what was written is removed.
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder& operator=(const ResultFolder&) = delete;

  const std::filesystem::path& path() const { return stage_; }
  // Warns, unless quiet, where the result of another program is replaced.
  void Commit(bool quiet);

 private:
  void Open();
  void Exchange();
  void MoveFiles();

  std::filesystem::path out_;     // as given
  std::filesystem::path target_;  // without links
  std::filesystem::path stage_;
  std::string program_;
  std::vector<std::string> owned_;  // file names that the new result replaces, written or not
  std::string replaced_program_;    // whose result `out` holds at the start, if another one
  FileLock alive_;  // on stage_, while the run lives: a stage that is not locked is left-over
  bool committed_ = false;
};

// Files that stay when one folder takes the place of another.

// Gives what `from` holds a second name in `to`, folders with all that is in them; copies where the
// file system has no second names. Left out: files named in `skip`, and names that `to` has. Throws
// InputError if a folder in `from` has the name of a file in `to`, or if the disk is full.
void LinkTree(const std::filesystem::path& from, const std::filesystem::path& to,
              const std::set<std::string>& skip);

// Removes `from` after LinkTree(). What came into it since then moves to `to`.
void RemoveLinked(const std::filesystem::path& from, const std::filesystem::path& to,
                  const std::set<std::string>& skip);

}  // namespace trueline
