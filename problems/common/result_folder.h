// A result folder that changes as one: all files of a run, or none.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/common/file_lock.h"

namespace trueline {

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

}  // namespace trueline
