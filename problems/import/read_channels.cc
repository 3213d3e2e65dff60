#include "problems/import/read_channels.h"

#include <set>

#include "problems/import/channel_row.h"

namespace trueline {

std::map<std::size_t, std::size_t> ReadChannels(Recording* recording,
                                                const std::vector<StreamImport*>& streams) {
  std::vector<ChannelRow> rows;
  std::set<std::size_t> channels;
  for (const StreamImport* stream : streams) {
    rows.emplace_back(*recording, stream->map().channel);
    channels.insert(stream->map().channel.begin(), stream->map().channel.end());
  }
  const std::vector<std::size_t> wanted(channels.begin(), channels.end());
  const std::vector<std::size_t> counts =
      recording->Visit(wanted, [&](std::size_t channel, const Record& record) {
        for (std::size_t i = 0; i < streams.size(); ++i) {
          if (rows[i].AddRecord(channel, record)) streams[i]->AddRow(rows[i]);
        }
      });
  std::map<std::size_t, std::size_t> undecoded;
  for (std::size_t i = 0; i < wanted.size(); ++i) undecoded[wanted[i]] = counts[i];
  return undecoded;
}

}  // namespace trueline
