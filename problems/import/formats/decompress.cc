#include "problems/import/formats/decompress.h"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <functional>
#include <memory>

namespace trueline {
namespace {

constexpr std::size_t kStep = 1 << 18;  // bytes

enum class StepResult { kMore, kEnd, kBad };
// Consumes from `in` and appends to the free bytes at `out`; tells how many it has written.
using DecompressStep = std::function<StepResult(std::string_view* in, char* out, std::size_t room,
                                                std::size_t* wrote)>;

bool RunSteps(const DecompressStep& step, std::string_view in, std::uint64_t limit,
              std::string* out) {
  for (;;) {
    const std::size_t before = out->size();
    const std::uint64_t room = std::min<std::uint64_t>(kStep, limit + 1 - before);
    out->resize(before + room);
    std::size_t wrote = 0;
    const std::size_t left = in.size();
    const StepResult progress = step(&in, out->data() + before, room, &wrote);
    out->resize(before + wrote);
    if (progress == StepResult::kBad || out->size() > limit) return false;
    if (progress == StepResult::kEnd) return true;
    if (wrote == 0 && in.size() == left) return false;  // cut off
  }
}

bool DecompressZstd(std::string_view bytes, std::uint64_t limit, std::string* out) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          ZSTD_freeDStream);
  return RunSteps(
      [&](std::string_view* in, char* to, std::size_t room, std::size_t* wrote) {
        ZSTD_inBuffer input{in->data(), in->size(), 0};
        ZSTD_outBuffer output{to, room, 0};
        const std::size_t left = ZSTD_decompressStream(stream.get(), &output, &input);
        in->remove_prefix(input.pos);
        *wrote = output.pos;
        if (ZSTD_isError(left) != 0) return StepResult::kBad;
        return left == 0 && in->empty() ? StepResult::kEnd : StepResult::kMore;
      },
      bytes, limit, out);
}

bool DecompressLz4(std::string_view bytes, std::uint64_t limit, std::string* out) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0) return false;
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      made, LZ4F_freeDecompressionContext);
  return RunSteps(
      [&](std::string_view* in, char* to, std::size_t room, std::size_t* wrote) {
        std::size_t consumed = in->size();
        *wrote = room;
        const std::size_t left =
            LZ4F_decompress(context.get(), to, wrote, in->data(), &consumed, nullptr);
        if (LZ4F_isError(left) != 0) {
          *wrote = 0;
          return StepResult::kBad;
        }
        in->remove_prefix(consumed);
        return left == 0 && in->empty() ? StepResult::kEnd : StepResult::kMore;
      },
      bytes, limit, out);
}

bool DecompressBz2(std::string_view bytes, std::uint64_t limit, std::string* out) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return false;
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> owner(&stream,
                                                                         BZ2_bzDecompressEnd);
  return RunSteps(
      [&](std::string_view* in, char* to, std::size_t room, std::size_t* wrote) {
        const auto given = static_cast<unsigned>(std::min<std::size_t>(in->size(), 1U << 30U));
        stream.next_in = const_cast<char*>(in->data());  // bzlib does not write there
        stream.avail_in = given;
        stream.next_out = to;
        stream.avail_out = static_cast<unsigned>(room);
        const int result = BZ2_bzDecompress(&stream);
        in->remove_prefix(given - stream.avail_in);
        *wrote = room - stream.avail_out;
        if (result == BZ_STREAM_END) return StepResult::kEnd;
        return result == BZ_OK ? StepResult::kMore : StepResult::kBad;
      },
      bytes, limit, out);
}

}  // namespace

bool Decompress(std::string_view compression, std::string_view bytes, std::uint64_t limit,
                std::string* out) {
  out->clear();
  if (compression == "zstd") return DecompressZstd(bytes, limit, out);
  if (compression == "lz4") return DecompressLz4(bytes, limit, out);
  if (compression == "bz2") return DecompressBz2(bytes, limit, out);
  if ((compression != "none" && !compression.empty()) || bytes.size() > limit) return false;
  out->assign(bytes);
  return true;
}

}  // namespace trueline
