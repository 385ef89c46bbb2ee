// SPDX-License-Identifier: BSD-3-Clause
#include <isa-l/erasure_code.h>
#include <isoreel/container/parity.h>

#include <algorithm>

#include "src/contents.h"
#include "src/open.h"
#include "src/window.h"

namespace isoreel {

using namespace container;

namespace {

// Below this a block costs more for its CRCs than it is worth.
constexpr std::uint64_t kMinBlock = 256;

using Blocks = std::vector<Bytes>;

std::vector<std::uint8_t*> pointers(Blocks& blocks) {
  std::vector<std::uint8_t*> result;
  for (Bytes& block : blocks) result.push_back(block.data());
  return result;
}

/// The whole matrix of the code: `data` rows of the identity, then `parity` rows (spec container 6.4).
Bytes codeMatrix(std::size_t data, std::size_t parity) {
  Bytes matrix((data + parity) * data);
  gf_gen_cauchy1_matrix(matrix.data(), static_cast<int>(data + parity), static_cast<int>(data));
  return matrix;
}

/// `rows` of coefficients times `in`.
Blocks combine(Bytes rows, Blocks& in, std::size_t block) {
  const std::size_t count = rows.size() / in.size();
  Bytes tables(32 * rows.size());
  ec_init_tables(static_cast<int>(in.size()), static_cast<int>(count), rows.data(), tables.data());
  Blocks out(count, Bytes(block));
  std::vector<std::uint8_t*> from = pointers(in), to = pointers(out);
  ec_encode_data(static_cast<int>(block), static_cast<int>(in.size()), static_cast<int>(count), tables.data(),
                 from.data(), to.data());
  return out;
}

Blocks cut(ByteSpan run, std::size_t block) {
  Blocks blocks;
  for (std::size_t start = 0; start < run.size(); start += block) {
    const ByteSpan bytes = run.subspan(start, std::min(block, run.size() - start));
    blocks.emplace_back(bytes.begin(), bytes.end());
    blocks.back().resize(block);
  }
  return blocks;
}

Status appendParity(Bytes& out, const ParityHead& head, const Bytes& data_crcs, std::span<const Bytes> rows) {
  Bytes payload;
  ISOREEL_TRY(writeSized(payload, head));
  ByteWriter writer(payload);
  writer.bytes(data_crcs);
  for (const Bytes& row : rows) writer.fixed(crc32c(row));
  writer.fixed(crc32c(payload));
  for (const Bytes& row : rows) writer.bytes(row);
  return appendChunk(out, kParityType, payload);
}

Result<Bytes> makeParity(ByteSpan run, unsigned percent) {
  // Damage that is contiguous and `percent` of the run long touches one block more than it fills.
  const std::uint64_t most = (ParityHead::kMaxBlocks - 2) * 100 / (100 + percent);
  ParityHead head;
  head.length = run.size();
  head.block = std::min(head.length, std::max(kMinBlock, (head.length - 1) / most + 1));
  const std::size_t data = static_cast<std::size_t>(head.dataBlocks());
  const std::size_t rows = (data * percent + 99) / 100 + 1;
  Blocks blocks = cut(run, static_cast<std::size_t>(head.block));
  Bytes crcs;
  for (const Bytes& block : blocks) ByteWriter(crcs).fixed(crc32c(block));
  Bytes matrix = codeMatrix(data, rows);
  matrix.erase(matrix.begin(), matrix.begin() + static_cast<std::ptrdiff_t>(data * data));
  const Blocks parity = combine(std::move(matrix), blocks, static_cast<std::size_t>(head.block));

  // Two chunks: damage at the end of the run may take the first.
  Bytes chunks;
  const std::size_t half = (rows + 1) / 2;
  head.rows = half;
  ISOREEL_TRY(appendParity(chunks, head, crcs, std::span(parity).first(half)));
  head.distance = chunks.size();
  head.first = half;
  head.rows = rows - half;
  ISOREEL_TRY(appendParity(chunks, head, crcs, std::span(parity).subspan(half)));
  return chunks;
}

/// What the PRTY chunks of one run say.
struct Run {
  std::uint64_t start = 0;
  ParityHead head;
  std::vector<std::uint32_t> crcs;    // of the data blocks
  std::map<std::size_t, Bytes> rows;  // good parity blocks by their number
  bool sameAs(const Run& other) const {
    return start == other.start && head.length == other.head.length && head.block == other.head.block &&
           crcs == other.crcs;
  }
};

/// Takes the payload of a PRTY chunk at `offset` apart. Its payload CRC does not matter: table and blocks
/// have theirs.
Result<Run> readParity(ByteSpan payload, std::uint64_t offset) {
  ByteReader in(payload);
  Run run;
  ISOREEL_TRY(readSized(in, run.head));
  const ParityHead& head = run.head;
  if (head.distance > offset || head.length > offset - head.distance)
    return {ErrorCode::kBadData, "parity: protects what is not there (spec container 6.4)"};
  run.start = offset - head.distance - head.length;
  for (std::uint64_t i = 0; i < head.dataBlocks(); ++i) run.crcs.push_back(in.fixed<std::uint32_t>());
  std::vector<std::uint32_t> row_crcs;
  for (std::uint64_t i = 0; i < head.rows; ++i) row_crcs.push_back(in.fixed<std::uint32_t>());
  const std::uint32_t crc = crc32c(payload.first(in.position()));
  if (in.fixed<std::uint32_t>() != crc || in.truncated())
    return {ErrorCode::kBadData, "parity: its table is damaged (spec container 6.4)"};
  for (std::size_t i = 0; i < row_crcs.size(); ++i) {
    const ByteSpan block = in.bytes(static_cast<std::size_t>(head.block));
    if (!in.truncated() && crc32c(block) == row_crcs[i])
      run.rows.emplace(static_cast<std::size_t>(head.first) + i, Bytes(block.begin(), block.end()));
  }
  return run;
}

/// The data blocks `lost`, computed from the others and as many rows of parity. They are in `blocks` already,
/// with wrong content. False when the matrix cannot be inverted, which a Cauchy code never does.
bool restore(const std::vector<std::size_t>& lost, const std::map<std::size_t, Bytes>& parity,
             Blocks& blocks) {
  const std::size_t data = blocks.size();
  const Bytes matrix = codeMatrix(data, parity.rbegin()->first + 1);
  Blocks in = blocks;
  Bytes taken(data * data);
  auto row = parity.begin();
  for (std::size_t i = 0, next = 0; i < data; ++i) {
    std::size_t source = i;
    if (next < lost.size() && lost[next] == i) {
      source = data + row->first;
      in[i] = (row++)->second;
      ++next;
    }
    std::copy_n(matrix.begin() + static_cast<std::ptrdiff_t>(source * data), data,
                taken.begin() + static_cast<std::ptrdiff_t>(i * data));
  }
  Bytes inverse(data * data);
  if (gf_invert_matrix(taken.data(), inverse.data(), static_cast<int>(data)) != 0) return false;
  Bytes rows;
  for (const std::size_t i : lost) {
    const auto from = inverse.begin() + static_cast<std::ptrdiff_t>(i * data);
    rows.insert(rows.end(), from, from + static_cast<std::ptrdiff_t>(data));
  }
  Blocks found = combine(std::move(rows), in, blocks[0].size());
  for (std::size_t i = 0; i < lost.size(); ++i) blocks[lost[i]] = std::move(found[i]);
  return true;
}

class ParityCheck {
 public:
  ParityCheck(ByteSource& source, std::uint64_t size) : source_(source), size_(size), window_(source, size) {}

  Result<ParityReport> run() {
    for (std::uint64_t at = window_.nextHeader(0); at < size_; at = window_.nextHeader(at + 1)) {
      const ByteSpan front = window_.at(at, ChunkHeader::kBytes);
      if (front.size() < ChunkHeader::kBytes) break;
      const Result<ChunkHeader> header = readChunkHeader(front);
      if (header.ok() && header->type == kParityType) ISOREEL_TRY(parity(at, header->length));
    }
    ISOREEL_TRY(window_.status());
    ISOREEL_TRY(check());
    return std::move(report_);
  }

 private:
  Status parity(std::uint64_t offset, std::uint64_t length) {
    const std::uint64_t room = size_ - offset - ChunkHeader::kBytes;
    read_ += length;
    // Chunks may claim to hold each other.
    if (length > kMaxParityPayload || read_ > 2 * size_) return {};
    ISOREEL_ASSIGN(const Bytes payload,
                   readExactly(source_, offset + ChunkHeader::kBytes, std::min(length, room)));
    Result<Run> found = readParity(payload, offset);
    if (!found.ok()) return {};  // the scan tells of damaged chunks
    if (run_ && run_->sameAs(*found)) {
      run_->rows.merge(found->rows);
      return {};
    }
    ISOREEL_TRY(check());
    run_ = *std::move(found);
    return {};
  }

  // The run that is collected.
  Status check() {
    if (!run_) return {};
    const Run run = *std::exchange(run_, std::nullopt);
    checked_ += run.head.length;
    if (checked_ > 4 * size_) return {};  // runs may overlap, but not without end
    ISOREEL_ASSIGN(const Bytes bytes, readExactly(source_, run.start, run.head.length));
    Blocks blocks = cut(bytes, static_cast<std::size_t>(run.head.block));
    std::vector<std::size_t> lost;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      if (crc32c(blocks[i]) != run.crcs[i]) lost.push_back(i);
    }
    ++report_.runs;
    report_.bytes += run.head.length;
    report_.damaged += lost.size();
    if (lost.empty()) return {};
    std::string line = "bytes " + std::to_string(run.start) + " to " +
                       std::to_string(run.start + run.head.length) + ": " + std::to_string(lost.size()) +
                       " of " + std::to_string(blocks.size()) + " blocks damaged, ";
    bool good = lost.size() <= run.rows.size() && restore(lost, run.rows, blocks);
    for (const std::size_t i : lost) good = good && crc32c(blocks[i]) == run.crcs[i];
    line +=
        good ? "restored by parity" : "and only " + std::to_string(run.rows.size()) + " good parity blocks";
    report_.lines.push_back(std::move(line));
    for (const std::size_t i : lost) {
      if (!good) break;
      const std::uint64_t start = i * run.head.block;
      blocks[i].resize(static_cast<std::size_t>(std::min(run.head.block, run.head.length - start)));
      report_.patches[run.start + start] = std::move(blocks[i]);
      ++report_.restored;
    }
    return {};
  }

  ByteSource& source_;
  const std::uint64_t size_;
  Window window_;
  std::optional<Run> run_;
  std::uint64_t read_ = 0, checked_ = 0;
  ParityReport report_;
};

class PatchedSource final : public ByteSource {
 public:
  PatchedSource(std::unique_ptr<ByteSource> source, std::map<std::uint64_t, Bytes> patches)
      : source_(std::move(source)), patches_(std::move(patches)) {}

  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    ISOREEL_ASSIGN(const std::size_t got, source_->read(offset, out));
    auto patch = patches_.upper_bound(offset);
    if (patch != patches_.begin()) --patch;
    for (; patch != patches_.end() && patch->first < offset + got; ++patch) {
      const std::uint64_t from = std::max(offset, patch->first);
      const std::uint64_t to = std::min(offset + got, patch->first + patch->second.size());
      for (std::uint64_t i = from; i < to; ++i)
        out[static_cast<std::size_t>(i - offset)] = patch->second[static_cast<std::size_t>(i - patch->first)];
    }
    return got;
  }
  std::optional<std::uint64_t> size() const override { return source_->size(); }
  bool seekable() const override { return source_->seekable(); }
  std::string name() const override { return source_->name(); }

 private:
  const std::unique_ptr<ByteSource> source_;
  const std::map<std::uint64_t, Bytes> patches_;
};

}  // namespace

ParityMaker reedSolomonParity(unsigned percent) {
  return [percent = std::clamp(percent, 1u, 100u)](ByteSpan run) { return makeParity(run, percent); };
}

Result<ParityReport> checkParity(ByteSource& source) {
  if (!source.seekable() || !source.size())
    return {ErrorCode::kInvalidArgument, source.name() + ": parity cannot be looked for in a pipe"};
  return withoutThrowing([&] { return ParityCheck(source, *source.size()).run(); }).at(source.name());
}

std::unique_ptr<ByteSource> patchedSource(std::unique_ptr<ByteSource> source,
                                          std::map<std::uint64_t, Bytes> patches) {
  return std::make_unique<PatchedSource>(std::move(source), std::move(patches));
}

}  // namespace isoreel
