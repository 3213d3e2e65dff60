#include "problems/common/app.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gflags/gflags.h>
#include <glog/logging.h>
#include <malloc.h>

#include <algorithm>
#include <cctype>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <sstream>
#include <system_error>
#include <utility>

#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/common/progress.h"

namespace google {
extern void (*gflags_exitfunc)(int);  // gflags' own hook; its default exits with 1 on a wrong flag
}

namespace trueline {
namespace {

// The flags that the executable itself defines; gflags' and glog's own are left to --helpfull.
std::string OwnFlags() {
  std::vector<gflags::CommandLineFlagInfo> flags;
  gflags::GetAllFlags(&flags);
  std::string text;
  for (const gflags::CommandLineFlagInfo& flag : flags) {
    if (flag.filename.find("apps/") == std::string::npos) continue;
    text += fmt::format("  --{:<14} {} (default: {})\n", flag.name, flag.description,
                        flag.default_value.empty() ? "none" : flag.default_value);
  }
  return text;
}

bool HasFlag(const char* name) {
  gflags::CommandLineFlagInfo info;
  return gflags::GetCommandLineFlagInfo(name, &info);
}

// Words that are no flags are the logs that a verb works on. Results then go beside, into a folder
// named by the first log and the verb, unless --out says where or the verb makes no page of a log.
// Throws InputError for any other word.
void TakeLogs(const std::string& program, const std::vector<std::string>& words) {
  namespace fs = std::filesystem;
  const char* flag = HasFlag("log") ? "log" : "in";
  std::string given, out;
  const bool takes = gflags::GetCommandLineOption(flag, &given) && given.empty();
  for (const std::string& word : words) {
    std::error_code unknown;
    if (takes && fs::exists(word, unknown)) continue;
    throw InputError(fmt::format("'{}' is not a flag{}; flags are --name=value (see {} --help)",
                                 word, takes ? ", nor a log that exists" : "", program));
  }
  if (words.empty()) return;
  gflags::SetCommandLineOption(flag, fmt::format("{}", fmt::join(words, ",")).c_str());
  if (!gflags::GetCommandLineOption("out", &out) || !out.empty() || !HasFlag("report")) return;
  const std::string first = fs::weakly_canonical(words.front()).filename().string();
  out = first.substr(0, first.find('.', 1)) + program.substr(program.find('-'));
  gflags::SetCommandLineOption("out", out.c_str());
}

// A configuration that ships goes from everywhere by its path in a clone, config/....
void FindConfigurations() {
  for (const char* flag : {"config", "map"}) {
    std::string given;
    std::error_code unknown;
    if (!gflags::GetCommandLineOption(flag, &given) || !given.starts_with("config/")) continue;
    if (!std::filesystem::exists(given, unknown)) {
      gflags::SetCommandLineOption(flag, FindShared(given).c_str());
    }
  }
}

// Keeps freed memory for the next allocation. By default glibc returns matrices of some 100 kB to
// the system each time that a thread frees them.
void KeepFreedMemory() {
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
}

// The log that a program was given, before an error that knows no file.
std::string LogGiven() {
  std::string log;
  for (const char* flag : {"log", "in"}) {
    if (gflags::GetCommandLineOption(flag, &log) && !log.empty()) return log + ": ";
  }
  return "";
}

}  // namespace

std::string Version() { return TRUELINE_VERSION; }

std::string Printable(std::string text) {
  for (char& c : text) {
    if (c != '\n' && std::iscntrl(static_cast<unsigned char>(c)) != 0) c = '?';
  }
  return text;
}

Failure CurrentFailure() {
  try {
    throw;
  } catch (const InputError& error) {
    const bool ran = dynamic_cast<const NoUsableResult*>(&error) != nullptr;
    return {ran ? kExitNoResult : kExitBadInput,
            "error: " + Printable(WithFinalNames(error.what()))};
  } catch (const std::filesystem::filesystem_error& error) {
    return {kExitBadInput, fmt::format("error: {}: {}; check the path and its permissions",
                                       Printable(error.path1().string()), error.code().message())};
  } catch (const std::system_error& error) {  // fmt's, when standard output is full
    return {kExitBadInput, fmt::format("error: {}; make room, or write elsewhere", error.what())};
  } catch (const std::bad_alloc&) {
    return {kExitBadInput, fmt::format("error: {}memory is used up; cut the log into shorter ones",
                                       Printable(LogGiven()))};
  } catch (const std::exception& error) {
    return {kExitDefect, fmt::format("internal error, please report it: {}", error.what())};
  }
}

int RunGuarded(const std::string& program, const std::function<int()>& body) {
  try {
    return body();
  } catch (const std::exception&) {
    const Failure failure = CurrentFailure();
    fmt::print(stderr, "{}: {}\n", program, failure.text);
    return failure.code;
  }
}

FailOn::FailOn(std::string asked, std::vector<std::string> outcomes)
    : asked_(std::move(asked)), outcomes_(std::move(outcomes)) {
  if (asked_.empty() || std::ranges::find(outcomes_, asked_) != outcomes_.end()) return;
  throw InputError(
      fmt::format("--fail_on={} is not known; use {}", asked_, fmt::join(outcomes_, " or ")));
}

int FailOn::ExitFor(const std::string& outcome, int otherwise) const {
  if (asked_.empty()) return otherwise;
  const auto refused = std::ranges::find(outcomes_, asked_);
  return std::find(refused, outcomes_.end(), outcome) != outcomes_.end() ? kExitRefused : otherwise;
}

int RunApp(const std::string& program, const std::string& usage, int* argc, char*** argv,
           const std::function<int()>& body) {
  KeepFreedMemory();
  google::gflags_exitfunc = [](int code) { std::exit(code == 0 ? kExitDone : kExitBadInput); };
  gflags::SetUsageMessage(usage);
  gflags::SetVersionString(Version());
  google::InitGoogleLogging((*argv)[0]);
  FLAGS_logtostderr = true;
  gflags::ParseCommandLineNonHelpFlags(argc, argv, true);
  std::string help;
  if (gflags::GetCommandLineOption("help", &help) && help == "true") {
    fmt::print("{}\n\nFlags:\n{}", usage, OwnFlags());
    return kExitDone;
  }
  gflags::HandleCommandLineHelpFlags();
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // messages and progress land between lines only
  std::signal(SIGXFSZ, SIG_IGN);             // a write beyond `ulimit -f` is an error, no kill
  return RunGuarded(program, [&] {
    TakeLogs(program, {*argv + 1, *argv + *argc});
    FindConfigurations();
    const int code = body();
    if (std::fflush(stdout) != 0) {
      throw InputError("standard output could not be written to the end; is the disk full?");
    }
    return code;
  });
}

void Warn(const std::string& message, bool quiet) {
  const std::string text = Printable(WithFinalNames(message));
  if (WarningSink()) return WarningSink()(text);
  if (quiet) return;
  ClearProgress();
  fmt::print(stderr, "warning: {}\n", text);
}

void WarnAll(const std::vector<std::string>& messages, bool quiet) {
  for (const std::string& message : messages) Warn(message, quiet);
}

std::vector<std::string> SplitList(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) {
    if (!part.empty()) parts.push_back(part);
  }
  return parts;
}

std::vector<std::string> SplitPaths(const std::string& text) {
  std::error_code unknown;
  if (std::filesystem::exists(text, unknown)) return {text};
  return SplitList(text);
}

std::string FindShared(const std::string& relative_path) {
  namespace fs = std::filesystem;
  std::vector<fs::path> candidates;
  Dl_info library{};
  ::dladdr(reinterpret_cast<const void*>(&FindShared), &library);
  std::error_code error;
  // The loader's path may hold "..", which has no parent folder.
  fs::path up = fs::weakly_canonical(library.dli_fname != nullptr ? library.dli_fname : "", error);
  for (int depth = 0; depth < 4; ++depth) {  // PREFIX/lib/glibc-hwcaps/x86-64-v3
    up = up.parent_path();
    candidates.push_back(up / "share/trueline" / relative_path);
  }
  candidates.push_back(fs::path(TRUELINE_SOURCE_DIR) / relative_path);
  candidates.push_back(fs::path(TRUELINE_SOURCE_DIR) / "scripts" / relative_path);
  candidates.push_back(fs::path(TRUELINE_SHARE_DIR) / relative_path);
  for (const fs::path& candidate : candidates) {
    if (fs::exists(candidate, error)) return candidate.string();
  }
  throw InputError(
      fmt::format("'{}' is neither here nor among the files of the program", relative_path));
}

}  // namespace trueline

namespace trueline {

std::string TextOf(const FlagValue& value) {
  return std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
}

bool Verb::Enter(std::string name, std::string usage, std::function<int()> run) {
  name_ = std::move(name);
  usage_ = std::move(usage);
  run_ = std::move(run);
  AllVerbs().push_back(this);
  return true;
}

Flag& Verb::Find(const std::string& name) {
  const auto found =
      std::ranges::find_if(flags_, [&](const Flag& flag) { return flag.name == name; });
  if (found != flags_.end()) return *found;
  throw InputError(fmt::format("{} has no flag '{}'", name_, name));
}

int Verb::Main(int argc, char** argv) {
  const std::string program = "trueline-" + name_;
  static const std::string file = "apps/" + name_ + ".cc";  // --help lists the flags of apps/ only
  for (Flag& flag : flags_) {
    std::visit(
        [&]<class T>(T& value) {
          gflags::FlagRegisterer(flag.name.c_str(), flag.help.c_str(), file.c_str(), &value,
                                 &std::get<T>(flag.initial));
        },
        flag.value);
  }
  return RunApp(program, usage_, &argc, &argv, run_);
}

std::vector<Verb*>& AllVerbs() {
  static std::vector<Verb*> verbs;
  return verbs;
}

std::function<void(const std::string&)>& WarningSink() {
  static std::function<void(const std::string&)> sink;
  return sink;
}

}  // namespace trueline
