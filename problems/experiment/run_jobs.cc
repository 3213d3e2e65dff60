#include <dlfcn.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/common/parallel.h"
#include "problems/common/progress.h"
#include "problems/experiment/job.h"

namespace trueline {
namespace {

// The library that holds this function; the executable if it is linked into that.
std::string LibraryFile() {
  Dl_info info = {};
  const bool known = ::dladdr(reinterpret_cast<void*>(&KeyOf), &info) != 0;
  const bool exists = known && info.dli_fname != nullptr && std::filesystem::exists(info.dli_fname);
  return exists ? info.dli_fname : "/proc/self/exe";
}

}  // namespace

std::string KeyOf(const std::string& description) {
  static const std::string program =
      Version() + Sha256OfFile("/proc/self/exe") + Sha256OfFile(LibraryFile());
  return Sha256OfText(program + "\n" + description).substr(0, 24);
}

StoredText ReuseOrMake(const std::filesystem::path& folder, const std::string& key,
                       const std::function<std::string()>& make) {
  if (folder.empty()) return {make(), false};
  const std::filesystem::path path = folder / (key + ".txt");
  std::ifstream file(path);
  std::string checksum;
  if (file && std::getline(file, checksum)) {
    std::ostringstream text;
    text << file.rdbuf();
    if (Sha256OfText(text.str()) == checksum) return {text.str(), true};
  }
  std::string text = make();
  WriteFileAtomically(path, Sha256OfText(text) + "\n" + text);
  return {std::move(text), false};
}

std::string ToText(JobResult result) {
  std::string text;
  result.ForEachTable([&](std::string kind, auto& rows) {
    for (auto& row : rows) {
      RowText archive(&text);
      archive(kind, row);
      text += "\n";
    }
  });
  return text;
}

JobResult ParseJobResult(const std::string& text, const std::string& file) {
  std::istringstream stream(text);
  JobResult result;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    RowText reader(line, fmt::format("{}:{}", file, number));
    std::string kind;
    reader(kind);
    bool known = false;
    result.ForEachTable([&](const std::string& name, auto& rows) {
      if (name != kind) return;
      reader(rows.emplace_back());
      known = true;
    });
    if (!known) reader.Fail();
  }
  return result;
}

ExperimentRun RunJobs(const std::vector<Job>& jobs, const std::filesystem::path& jobs_folder,
                      int threads, bool quiet) {
  const auto start = std::chrono::steady_clock::now();
  const int count = static_cast<int>(jobs.size());
  ExperimentRun run;
  run.outcomes.resize(jobs.size());
  std::atomic<int> reused{0};
  Progress progress(count, "flights", quiet);
  ParallelFor(count, threads, [&](int i) {
    JobOutcome& outcome = run.outcomes[i];
    outcome.job = jobs[i];
    try {
      const StoredText stored =
          ReuseOrMake(jobs_folder, jobs[i].key, [&] { return ToText(RunJob(jobs[i])); });
      reused += stored.reused;
      outcome.result = ParseJobResult(stored.text, jobs[i].key);
    } catch (const InputError& error) {
      outcome.failure = error.what();
    }
    progress.Done();
  });
  run.reused = reused;
  run.wall_time = SecondsSince(start);
  return run;
}

}  // namespace trueline
