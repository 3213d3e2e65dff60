#include "problems/log/decompress.h"

#include <bzlib.h>
#include <lz4frame.h>
#include <lzma.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <memory>

namespace trueline {

Decoder Inflater(int bits) {
  auto stream = std::shared_ptr<z_stream>(new z_stream{}, [](z_stream* s) {
    inflateEnd(s);
    delete s;
  });
  inflateInit2(stream.get(), bits);
  return [stream, bits](const char* in, std::size_t have, char* out, std::size_t room, bool) {
    stream->next_in = reinterpret_cast<Bytef*>(const_cast<char*>(in));  // zlib does not write there
    stream->avail_in = static_cast<uInt>(have);
    stream->next_out = reinterpret_cast<Bytef*>(out);
    stream->avail_out = static_cast<uInt>(room);
    const int result = inflate(stream.get(), Z_NO_FLUSH);
    const DecodeStep step{have - stream->avail_in, room - stream->avail_out, result == Z_STREAM_END,
                          result == Z_OK || result == Z_STREAM_END || result == Z_BUF_ERROR};
    if (step.ended && bits > 0) inflateReset(stream.get());  // gzip's members follow each other
    return step;
  };
}

Decoder Bunzipper() {
  auto stream = std::shared_ptr<bz_stream>(new bz_stream{}, [](bz_stream* s) {
    BZ2_bzDecompressEnd(s);
    delete s;
  });
  BZ2_bzDecompressInit(stream.get(), 0, 0);
  return [stream](const char* in, std::size_t have, char* out, std::size_t room, bool) {
    stream->next_in = const_cast<char*>(in);  // bzlib does not write there
    stream->avail_in = static_cast<unsigned>(have);
    stream->next_out = out;
    stream->avail_out = static_cast<unsigned>(room);
    const int result = BZ2_bzDecompress(stream.get());
    const DecodeStep step{have - stream->avail_in, room - stream->avail_out,
                          result == BZ_STREAM_END, result == BZ_OK || result == BZ_STREAM_END};
    if (step.ended) {
      BZ2_bzDecompressEnd(stream.get());
      BZ2_bzDecompressInit(stream.get(), 0, 0);
    }
    return step;
  };
}

Decoder Unxzipper() {
  auto stream = std::shared_ptr<lzma_stream>(new lzma_stream{}, [](lzma_stream* s) {
    lzma_end(s);
    delete s;
  });
  if (lzma_stream_decoder(stream.get(), UINT64_MAX, LZMA_CONCATENATED) != LZMA_OK) return nullptr;
  return [stream](const char* in, std::size_t have, char* out, std::size_t room, bool is_last) {
    stream->next_in = reinterpret_cast<const std::uint8_t*>(in);
    stream->avail_in = have;
    stream->next_out = reinterpret_cast<std::uint8_t*>(out);
    stream->avail_out = room;
    const lzma_ret result = lzma_code(stream.get(), is_last ? LZMA_FINISH : LZMA_RUN);
    return DecodeStep{have - stream->avail_in, room - stream->avail_out, result == LZMA_STREAM_END,
                      result == LZMA_OK || result == LZMA_STREAM_END || result == LZMA_BUF_ERROR};
  };
}

Decoder Unzstder() {
  auto stream = std::shared_ptr<ZSTD_DStream>(ZSTD_createDStream(), ZSTD_freeDStream);
  return [stream](const char* in, std::size_t have, char* out, std::size_t room, bool) {
    ZSTD_inBuffer input{in, have, 0};
    ZSTD_outBuffer output{out, room, 0};
    const std::size_t left = ZSTD_decompressStream(stream.get(), &output, &input);
    return DecodeStep{input.pos, output.pos, left == 0, ZSTD_isError(left) == 0};
  };
}

Decoder Unlz4er() {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0) return nullptr;
  auto context = std::shared_ptr<LZ4F_dctx>(made, LZ4F_freeDecompressionContext);
  return [context](const char* in, std::size_t have, char* out, std::size_t room, bool) {
    std::size_t read = have, wrote = room;
    const std::size_t left = LZ4F_decompress(context.get(), out, &wrote, in, &read, nullptr);
    if (LZ4F_isError(left) != 0) return DecodeStep{0, 0, false, false};
    return DecodeStep{read, wrote, left == 0, true};
  };
}

Decoder Copier() {
  return [](const char* in, std::size_t have, char* out, std::size_t room, bool is_last) {
    const std::size_t count = std::min(have, room);
    std::copy_n(in, count, out);
    return DecodeStep{count, count, is_last && count == have, true};
  };
}

bool Decompress(std::string_view compression, std::string_view in, std::uint64_t limit,
                std::string* out) {
  constexpr std::uint64_t kStep = 1 << 18;  // bytes
  out->clear();
  const bool bz2 = compression == "bz2";  // whatever follows its end
  const Decoder decode = bz2                     ? Bunzipper()
                         : compression == "zstd" ? Unzstder()
                         : compression == "lz4"  ? Unlz4er()
                                                 : nullptr;
  if (decode == nullptr) {
    if ((compression != "none" && !compression.empty()) || in.size() > limit) return false;
    out->assign(in);
    return true;
  }
  for (;;) {
    const std::size_t before = out->size();
    const std::size_t room = std::min(kStep, limit + 1 - before);
    out->resize(before + room);
    const DecodeStep step = decode(in.data(), in.size(), out->data() + before, room, true);
    out->resize(before + step.wrote);
    in.remove_prefix(step.read);
    if (!step.good || out->size() > limit) return false;
    if (step.ended && (in.empty() || bz2)) return true;
    if (step.wrote == 0 && step.read == 0) return false;  // cut off
  }
}

}  // namespace trueline
