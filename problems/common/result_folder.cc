#include "problems/common/result_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <map>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/error.h"

namespace trueline {

namespace fs = std::filesystem;

void WriteManifest(const fs::path& folder, const std::string& program) {
  std::map<std::string, std::string> digests;
  for (const auto& entry : fs::directory_iterator(folder)) {
    digests[entry.path().filename().string()] = Sha256OfFile(entry.path());
  }
  YAML::Emitter text;
  text << YAML::BeginMap << YAML::Key << "program" << YAML::Value << program;
  text << YAML::Key << "version" << YAML::Value << Version();
  text << YAML::Key << "sha256" << YAML::Value << digests << YAML::EndMap << YAML::Newline;
  WriteFileAtomically(folder / kManifestFile, text.c_str());
}

Manifest ReadManifest(const fs::path& folder) {
  Manifest manifest;
  try {
    const YAML::Node node = YAML::LoadFile((folder / kManifestFile).string());
    const auto program = node["program"].as<std::string>();
    if (!program.starts_with("trueline-")) return {};
    manifest.program = program;
    for (const auto& entry : node["sha256"]) {
      const auto name = entry.first.as<std::string>();
      if (fs::path(name).filename() == name && name != "." && name != "..") {
        manifest.files.push_back(name);
      }
    }
  } catch (const YAML::Exception&) {
    return {};
  }
  return manifest;
}

FileLock::FileLock(const std::filesystem::path& path, bool wait) {
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) return;
  int result = 0;
  do {
    result = ::flock(descriptor_, wait ? LOCK_EX : LOCK_EX | LOCK_NB);
  } while (result != 0 && errno == EINTR);
  if (result == 0 || errno != EWOULDBLOCK) return;
  ::close(descriptor_);
  descriptor_ = -1;
}

FileLock::~FileLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

FileLock::FileLock(FileLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

FileLock& FileLock::operator=(FileLock&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

bool FileLock::Holds(const std::filesystem::path& path) const {
  struct stat held = {}, there = {};
  return locked() && ::fstat(descriptor_, &held) == 0 && ::stat(path.c_str(), &there) == 0 &&
         held.st_dev == there.st_dev && held.st_ino == there.st_ino;
}

namespace fs = std::filesystem;
namespace {

std::string StagePrefix(const fs::path& target) {
  return "." + target.filename().string() + ".part-";
}

// Removes the stages of runs that were killed: nobody holds their lock.
void RemoveLeftovers(const fs::path& folder, const std::string& prefix) {
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (!it->path().filename().string().starts_with(prefix)) continue;
    const FileLock lock(it->path(), false);
    std::error_code ignored;
    if (lock.Holds(it->path())) fs::remove_all(it->path(), ignored);
  }
}

// Makes and locks a folder of a name that is free. Empty where none can be made.
fs::path MakeStage(const fs::path& folder, const std::string& prefix, FileLock* alive) {
  for (int i = 0; i < 100; ++i) {
    fs::path stage = folder / fmt::format("{}{}-{}", prefix, ::getpid(), i);
    if (::mkdir(stage.c_str(), 0777) != 0) {
      if (errno == EEXIST) continue;
      return {};
    }
    *alive = FileLock(stage, true);
    if (alive->Holds(stage)) return stage;  // else another run took it for a leftover
  }
  return {};
}

// Whether the folder is the working folder or above it: a shell in it would lose its place.
bool IsWorkingFolder(const fs::path& target) {
  std::error_code error;
  const fs::path working = fs::canonical(".", error);
  const auto [left, right] =
      std::mismatch(target.begin(), target.end(), working.begin(), working.end());
  return !error && left == target.end();
}

// Data first, then names: after a power cut a name never stands for an empty file.
void Sync(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

InputError CannotWrite(const fs::path& out, const std::string& why) {
  return ErrorAt(out.string(), 0,
                 fmt::format("cannot be written ({}); check that the folder "
                             "exists, is writable and has space",
                             why));
}

std::string LastError() { return std::generic_category().message(errno); }

void RenameOrCopy(const fs::path& from, const fs::path& to) {
  if (::rename(from.c_str(), to.c_str()) == 0) return;
  if (errno != EXDEV) throw CannotWrite(to, LastError());
  const fs::path near = to.string() + ".tmp";  // `to` is on another file system
  std::error_code error;
  fs::copy_file(from, near, fs::copy_options::overwrite_existing, error);
  if (error || ::rename(near.c_str(), to.c_str()) != 0) {
    throw CannotWrite(to, error ? error.message() : LastError());
  }
}

// A native log replaces an earlier one, and no other files of the same names.
void RefuseForeignFiles(const fs::path& out, const std::vector<std::string>& owned) {
  constexpr char kLog[] = "log.yaml";
  std::error_code unknown;
  const bool makes_log = std::find(owned.begin(), owned.end(), kLog) != owned.end();
  if (!makes_log || fs::exists(out / kLog, unknown)) return;
  for (const std::string& name : owned) {
    if (!name.ends_with(".csv") || !fs::exists(out / name, unknown)) continue;
    throw ErrorAt((out / name).string(), 0,
                  "is there without a log.yaml, so it is of no native log and would be replaced; "
                  "give another --out");
  }
}

}  // namespace

ResultFolder::ResultFolder(const fs::path& out, const std::string& program)
    : out_(out), program_(program) {
  Open();
  NameStage(stage_, out_);
  const Manifest old = ReadManifest(target_);
  owned_ = old.files;
  owned_.emplace_back(kManifestFile);
  if (!old.program.empty() && old.program != program) replaced_program_ = old.program;
}

ResultFolder::ResultFolder(const fs::path& out, const std::vector<std::string>& owned)
    : out_(out), owned_(owned) {
  RefuseForeignFiles(out_, owned_);
  Open();
  NameStage(stage_, out_);
}

ResultFolder::~ResultFolder() {
  std::error_code ignored;
  if (!committed_) fs::remove_all(stage_, ignored);
}

void ResultFolder::Open() {
  std::error_code error;
  target_ = fs::weakly_canonical(fs::absolute(out_), error);
  if (!target_.has_filename()) target_ = target_.parent_path();  // "out/"
  if (error) throw CannotWrite(out_, error.message());
  fs::create_directories(target_.parent_path(), error);
  if (error) throw CannotWrite(out_, error.message());
  const bool exists = fs::exists(target_, error);
  if (exists && !fs::is_directory(target_)) throw CannotWrite(out_, "it is a file");
  if (exists && ::access(target_.c_str(), W_OK) != 0) throw CannotWrite(out_, LastError());
  const std::string prefix = StagePrefix(target_);
  RemoveLeftovers(target_.parent_path(), prefix);
  stage_ = MakeStage(target_.parent_path(), prefix, &alive_);
  if (!stage_.empty()) return;
  if (!exists) throw CannotWrite(out_, LastError());
  RemoveLeftovers(target_, prefix);
  stage_ = MakeStage(target_, prefix, &alive_);
  if (stage_.empty()) throw CannotWrite(out_, LastError());
}

void ResultFolder::Commit(bool quiet) {
  if (!program_.empty()) WriteManifest(stage_, program_);
  for (const auto& entry : fs::directory_iterator(stage_)) Sync(entry.path());
  const FileLock one_at_a_time(target_.parent_path(), true);
  // Another run may have ended since this one began; its files are replaced, too.
  if (!program_.empty()) {
    for (const std::string& name : ReadManifest(target_).files) owned_.push_back(name);
  }
  const bool beside = stage_.parent_path() == target_.parent_path();
  if (!fs::exists(target_)) {
    if (::rename(stage_.c_str(), target_.c_str()) != 0) throw CannotWrite(out_, LastError());
  } else if (beside && !IsWorkingFolder(target_)) {
    Exchange();
  } else {
    MoveFiles();
  }
  Sync(target_.parent_path());
  committed_ = true;
  if (replaced_program_.empty()) return;
  Warn(fmt::format("{}: the result of {} that was here is replaced", out_.string(),
                   replaced_program_),
       quiet);
}

void ResultFolder::Exchange() {
  const std::set<std::string> owned(owned_.begin(), owned_.end());
  LinkTree(target_, stage_, owned);
  struct stat status = {};
  if (::stat(target_.c_str(), &status) == 0) ::chmod(stage_.c_str(), status.st_mode & 07777);
  if (::renameat2(AT_FDCWD, stage_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) != 0) {
    MoveFiles();  // a mount point, or a file system that exchanges nothing
    return;
  }
  RemoveLinked(stage_, target_, owned);  // stage_ is the name of the old folder now
}

void ResultFolder::MoveFiles() {
  std::error_code error;
  fs::remove(target_ / kManifestFile, error);
  for (const std::string& name : owned_) {
    if (!fs::exists(stage_ / name)) fs::remove(target_ / name, error);
  }
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(stage_)) {
    if (entry.path().filename() != kManifestFile) files.push_back(entry.path());
  }
  if (fs::exists(stage_ / kManifestFile)) files.push_back(stage_ / kManifestFile);
  for (const fs::path& file : files) RenameOrCopy(file, target_ / file.filename());
  fs::remove_all(stage_, error);
}

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
