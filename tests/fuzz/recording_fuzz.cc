// One reader of foreign logs, TRUELINE_FUZZ_WALK, on any bytes: it lists the channels and decodes
// every record. Anything but an InputError is a crash.
#include "problems/common/error.h"
#include "problems/import/channel_row.h"
#include "problems/import/formats/csv_table.h"
#include "problems/import/formats/open_recording.h"
#include "tests/fuzz/fuzz_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const trueline::FuzzFile file("log");
  file.Write(data, size);
  try {
    trueline::Recording recording(file.path(), {"fuzzed", "fuzzed", trueline::TRUELINE_FUZZ_WALK});
    trueline::ListChannels(recording);
    std::vector<std::size_t> all(recording.channels().size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
    recording.Visit(all, [](std::size_t, const trueline::Record& record) {
      for (const trueline::Cell& cell : record.cells) static_cast<void>(cell.Number());
    });
  } catch (const trueline::InputError&) {
    return 0;
  }
  return 0;
}
