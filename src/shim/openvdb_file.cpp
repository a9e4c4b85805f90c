// .vdb files. The reader of OpenVDB 10.0.1 crashes on some damaged files (it writes past its buffers where
// Blosc data lie about their size): positions and sizes are checked here and a short file shows as an error,
// but damage inside the packed data cannot be seen beforehand. Who reads untrusted files makes a trial read
// in a child process first, as the command line does.
#include "base/file.h"
#include "shim/openvdb_examine.h"

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/Stream.h>
#include <streambuf>
#include <sys/stat.h>
#include <vector>

namespace vshi {

namespace {

using openvdb::GridBase;
using openvdb::MetaMap;
using openvdb::io::GridDescriptor;

constexpr const char *SHELL_THICKNESS = "vdbshade_shell_thickness"; // metadata, world units

// Magic number (8 bytes), version of the format (4) and of the library (8), 1 byte, and the file's UUID.
constexpr size_t UUID_AT = 21;
constexpr size_t UUID_LENGTH = 36;
constexpr size_t HEADER = UUID_AT + UUID_LENGTH;
constexpr unsigned char MAGIC[8] = {0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0};

void initialize() {
    static const bool once = (openvdb::initialize(), true);
    static_cast<void>(once);
}

// The file's size, once it is known to be a .vdb file that OpenVDB has a chance to read.
uint64_t check_file(const char *path, vsh_error *error) {
    const auto fail = [&](const char *reason) {
        return Failure{vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path, reason)};
    };
    struct stat status;
    if (::stat(path, &status) != 0) {
        throw fail(std::strerror(errno));
    }
    if (!S_ISREG(status.st_mode)) {
        throw fail(S_ISDIR(status.st_mode) ? "it is a folder" : "it is no regular file");
    }
    const std::unique_ptr<FILE, int (*)(FILE *)> file(std::fopen(path, "rbe"), std::fclose);
    if (file == nullptr) {
        throw fail(std::strerror(errno));
    }
    unsigned char header[HEADER];
    const size_t size = std::fread(header, 1, sizeof header, file.get());
    if (size == 0 && std::ferror(file.get())) {
        throw fail(std::strerror(errno));
    }
    if (std::memcmp(header, MAGIC, std::min(size, sizeof MAGIC)) != 0 || size == 0) {
        throw fail("it is no OpenVDB file");
    }
    if (size < sizeof header) {
        throw fail("it is cut short within its header");
    }
    const uint32_t version =
        header[8] | uint32_t(header[9]) << 8 | uint32_t(header[10]) << 16 | uint32_t(header[11]) << 24;
    if (version > openvdb::OPENVDB_FILE_VERSION) {
        throw Failure{vshi_fail(error, VSH_ERROR_READ,
                                "%s: cannot be read: format version %u, this OpenVDB reads up to %u", path,
                                version, uint32_t(openvdb::OPENVDB_FILE_VERSION))};
    }
    return uint64_t(status.st_size);
}

std::string shown_name(const GridDescriptor &entry) {
    return GridDescriptor::nameAsString(entry.uniqueName());
}

// A file's grids in the order in which it holds them. OpenVDB's own class for this loads late (a handle to
// the file would linger) and goes on past the end of a file that is cut short.
class Reader final : public openvdb::io::Archive {
  public:
    Reader(const char *path, vsh_error *error);

    size_t count() const { return entries.size(); }
    std::string name(size_t i) const { return shown_name(entries[i]); }
    bool is_named(size_t i, const char *wanted) const {
        return name(i) == wanted || entries[i].gridName() == wanted;
    }
    MetaMap metadata(size_t i);
    GridBase::Ptr grid(size_t i);

    const uint64_t size;

  private:
    void list(std::istream &in, const char *path, vsh_error *error);

    // The stream keeps this pointer's address.
    openvdb::io::StreamMetadata::Ptr state = std::make_shared<openvdb::io::StreamMetadata>();
    std::ifstream stream;
    std::vector<GridDescriptor> entries;
    std::vector<GridBase::Ptr> grids; // without a tree yet, but for streamed files
    bool streamed = false;
};

Reader::Reader(const char *path, vsh_error *error) : size(check_file(path, error)) {
    stream.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    stream.open(path, std::ios::binary);
    openvdb::io::setStreamMetadataPtr(stream, state, false);
    readHeader(stream);
    setFormatVersion(stream); // what is read from it from here on depends on these
    setLibraryVersion(stream);
    setDataCompression(stream);
    streamed = !inputHasGridOffsets();
    if (streamed) {
        stream.seekg(0);
        openvdb::io::Stream all(stream, false);
        for (const GridBase::Ptr &one : *all.getGrids()) {
            entries.emplace_back(one->getName(), one->type());
            grids.push_back(one);
        }
    } else {
        MetaMap().readMeta(stream);
        list(stream, path, error);
    }
}

void Reader::list(std::istream &in, const char *path, vsh_error *error) {
    const int32_t number = readGridCount(in);
    for (int32_t i = 0; i < number; ++i) {
        GridDescriptor entry;
        grids.push_back(entry.read(in));
        const int64_t begin = entry.getGridPos(), blocks = entry.getBlockPos(), end = entry.getEndPos();
        if (begin < int64_t(HEADER) || end <= in.tellg() ||
            (!entry.isInstance() && (blocks < begin || end < blocks))) {
            throw Failure{vshi_fail(error, VSH_ERROR_READ, "%s: damaged: grid '%s' at bytes %lld … %lld",
                                    path, shown_name(entry).c_str(), static_cast<long long>(begin),
                                    static_cast<long long>(end))};
        }
        if (uint64_t(end) > size) {
            throw Failure{vshi_fail(error, VSH_ERROR_READ,
                                    "%s: cut short: grid '%s' ends at byte %lld, the file at %llu", path,
                                    shown_name(entry).c_str(), static_cast<long long>(end),
                                    static_cast<unsigned long long>(size))};
        }
        entries.push_back(entry);
        entry.seekToEnd(in);
    }
}

MetaMap Reader::metadata(size_t i) {
    if (streamed) {
        return *grids[i];
    }
    entries[i].seekToGrid(stream);
    readGridCompression(stream);
    MetaMap metadata;
    metadata.readMeta(stream);
    return metadata;
}

GridBase::Ptr Reader::grid(size_t i) {
    if (streamed) {
        return grids[i];
    }
    const GridDescriptor &entry = entries[i];
    const GridBase::Ptr result = grids[i]->copyGrid();
    entry.seekToGrid(stream);
    readGrid(result, entry, stream);
    if (entry.isInstance()) { // of another grid's tree
        NamedGridMap named{{entry.uniqueName(), result}};
        for (size_t j = 0; j < entries.size(); ++j) {
            if (j != i && !entries[j].isInstance() && entries[j].uniqueName() == entry.instanceParentName()) {
                const GridBase::Ptr parent = grids[j]->copyGrid();
                entries[j].seekToGrid(stream);
                readGrid(parent, entries[j], stream);
                named[entries[j].uniqueName()] = parent;
            }
        }
        connectInstance(entry, named);
    }
    return result;
}

// Reading past the end of the file shows as this exception, whose own words are of no use.
template <typename Body> vsh_result guard_file(vsh_error *error, const char *path, Body &&body) {
    return guard(error, VSH_ERROR_READ, path, [&]() -> vsh_result {
        try {
            initialize();
            return body();
        } catch (const std::ios_base::failure &) {
            return vshi_fail(error, VSH_ERROR_READ, "%s: cut short or damaged", path);
        }
    });
}

std::string class_of(const MetaMap &metadata) {
    const auto text = metadata.getMetadata<openvdb::StringMetadata>(GridBase::META_GRID_CLASS);
    return text ? text->value() : "";
}

size_t choose(Reader &reader, const char *path, const char *name, vsh_error *error) {
    if (reader.count() == 0) {
        throw Failure{vshi_fail(error, VSH_ERROR_INPUT, "%s: holds no grids", path)};
    }
    std::string names;
    for (size_t i = 0; i < reader.count(); ++i) {
        if (name != nullptr
                ? reader.is_named(i, name)
                : class_of(reader.metadata(i)) == GridBase::gridClassToString(openvdb::GRID_LEVEL_SET)) {
            return i;
        }
        names += (i > 0 ? ", '" : "'") + reader.name(i) + "'";
    }
    if (name == nullptr) {
        return 0; // to be refused with its reason
    }
    throw Failure{
        vshi_fail(error, VSH_ERROR_INPUT, "%s: no grid '%s'; it holds %.700s", path, name, names.c_str())};
}

// With the file's name in front, where the message is of a layer that does not know it.
void check_bytes(const vsh_run &run, double bytes, const char *path, vsh_error *error) {
    const vsh_result result = vshi_check_limit(&run, bytes, path, error);
    if (result != VSH_OK) {
        throw Failure{result};
    }
}

// As floats, without what else the file said about it.
FloatGrid::Ptr to_floats(const GridBase::Ptr &grid) {
    FloatTree::Ptr tree;
    if (grid->isType<openvdb::DoubleGrid>()) {
        tree = std::make_shared<FloatTree>(openvdb::gridPtrCast<openvdb::DoubleGrid>(grid)->tree());
    } else {
        tree = openvdb::gridPtrCast<FloatGrid>(grid)->treePtr();
    }
    const FloatGrid::Ptr floats = FloatGrid::create(tree);
    floats->setTransform(grid->transform().copy());
    return floats;
}

double shell_of(const GridBase &grid) {
    const auto shell = grid.getMetadata<openvdb::DoubleMetadata>(SHELL_THICKNESS);
    return shell && std::isfinite(shell->value()) && shell->value() > 0.0 ? shell->value() : 0.0;
}

vsh_result read(const char *path, const char *name, const vsh_run &run, vsh_grid **grid, vsh_error *error) {
    Stage stage(run, "load", error);
    stage.check();
    Reader reader(path, error);
    const size_t chosen = choose(reader, path, name, error);
    const std::string shown = reader.name(chosen);
    const auto refuse = [&](const Finding &finding) {
        if (finding.kind == Finding::BAD) {
            throw Failure{vshi_fail(error, VSH_ERROR_INPUT, "%s: grid '%s' cannot cast shadows: %s", path,
                                    shown.c_str(), finding.text.c_str())};
        }
    };
    const MetaMap metadata = reader.metadata(chosen);
    const auto bytes = metadata.getMetadata<openvdb::Int64Metadata>(GridBase::META_FILE_MEM_BYTES);
    check_bytes(run, bytes ? double(bytes->value()) : double(reader.size), path, error);

    const GridBase::Ptr found = reader.grid(chosen);
    stage.reach(0.3);
    stage.check();
    refuse(examine_kind(*found));
    FloatGrid::Ptr floats = to_floats(found);
    check_bytes(run, double(floats->memUsage()), path, error);
    const Finding finding = examine_values(*floats, stage);
    refuse(finding);
    if (finding.kind == Finding::ODD) {
        vshi_warn(&run, "%s: grid '%s': %s: its distances were made anew", path, shown.c_str(),
                  finding.text.c_str());
        floats = mend(*floats, stage, error);
    }
    *grid = close_grid(floats, shell_of(*found), stage);
    return VSH_OK;
}

// Writes through a sink: OpenVDB's own file writing does not look whether the last bytes arrived.
class SinkBuffer final : public std::streambuf {
  public:
    explicit SinkBuffer(const char *path) : sink(vshi_sink_open(path)), bytes(size_t(1) << 20) {}
    ~SinkBuffer() override { finish(); }
    SinkBuffer(const SinkBuffer &) = delete;
    SinkBuffer &operator=(const SinkBuffer &) = delete;

    int finish() { // the errno of the first failure, or 0
        flush();
        return vshi_sink_close(&sink);
    }

  protected:
    std::streamsize xsputn(const char *data, std::streamsize count) override {
        if (size_t(count) > bytes.size() - used) {
            flush();
        }
        if (size_t(count) > bytes.size()) {
            vshi_sink_write(&sink, data, size_t(count), at);
            at += uint64_t(count);
        } else {
            std::memcpy(bytes.data() + used, data, size_t(count));
            used += size_t(count);
        }
        return count; // failures are told by finish()
    }
    int_type overflow(int_type value) override {
        const char byte = traits_type::to_char_type(value);
        xsputn(&byte, 1);
        return traits_type::not_eof(value);
    }
    int sync() override {
        flush();
        return 0;
    }
    pos_type seekpos(pos_type position, std::ios_base::openmode) override {
        flush();
        at = uint64_t(std::streamoff(position));
        return position;
    }
    pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode mode) override {
        if (from == std::ios_base::end) {
            return pos_type(off_type(-1)); // never asked for
        }
        const off_type now = off_type(at + used);
        return from == std::ios_base::cur && offset == 0
                   ? pos_type(now)
                   : seekpos(pos_type(from == std::ios_base::cur ? now + offset : offset), mode);
    }

  private:
    void flush() {
        if (used > 0 && sink.file >= 0) {
            vshi_sink_write(&sink, bytes.data(), used, at);
        }
        at += used;
        used = 0;
    }

    vshi_sink sink;
    std::vector<char> bytes;
    size_t used = 0;
    uint64_t at = 0; // of the first byte of `bytes`
};

class Writer final : public openvdb::io::Archive {
  public:
    Writer() {
        setCompression(openvdb::io::COMPRESS_ACTIVE_MASK |
                       (hasBloscCompression()  ? openvdb::io::COMPRESS_BLOSC
                        : hasZLibCompression() ? openvdb::io::COMPRESS_ZIP
                                               : openvdb::io::COMPRESS_NONE));
    }
    void put(std::ostream &out, const FloatGrid::ConstPtr &grid) const {
        Archive::write(out, openvdb::GridCPtrVec{grid}, true);
    }
};

// In place of OpenVDB's random one: the same grid gives the same bytes. FNV-1a over the values.
std::string content_uuid(const vsh_grid &grid) {
    uint64_t hash[2] = {0xcbf29ce484222325u, 0x84222325cbf29ce4u};
    const auto add = [&](uint64_t word) {
        for (uint64_t &h : hash) {
            h = (h ^ word) * 0x100000001b3u;
        }
        hash[1] ^= hash[1] >> 29;
    };
    for (auto leaf = grid.level_set->tree().cbeginLeaf(); leaf; ++leaf) {
        const float *values = leaf->buffer().data();
        for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
            uint32_t bits;
            std::memcpy(&bits, values + i, sizeof bits);
            add(bits);
        }
    }
    char text[UUID_LENGTH + 1];
    std::snprintf(text, sizeof text, "%08x-%04x-4%03x-8%03x-%012llx", unsigned(hash[0] >> 32),
                  unsigned(hash[0] >> 16) & 0xffffu, unsigned(hash[0]) & 0xfffu,
                  unsigned(hash[1] >> 48) & 0xfffu,
                  static_cast<unsigned long long>(hash[1] & 0xffffffffffffu));
    return text;
}

struct Output {
    vshi_output file{nullptr, nullptr};
    ~Output() { vshi_output_abandon(&file); } // nothing, once committed
};

// Below, OpenVDB takes a voxel's volume for 0 while it copies what it writes.
constexpr double SMALLEST_WRITTEN = 1.45e-5;

vsh_result write(const vsh_grid &grid, const char *path, const char *name, vsh_error *error) {
    if (grid.info.voxel_size < SMALLEST_WRITTEN) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: voxel size %g: OpenVDB writes %g and more; scale the scene", path,
                         grid.info.voxel_size, SMALLEST_WRITTEN);
    }
    Output output;
    const vsh_result result = vshi_output_begin(&output.file, path, error);
    if (result != VSH_OK) {
        return result;
    }
    const FloatGrid::Ptr named = FloatGrid::create(grid.level_set->treePtr()); // shares the tree
    named->setTransform(grid.level_set->transform().copy());
    named->setName(name);
    named->setGridClass(openvdb::GRID_LEVEL_SET);
    named->setCreator(std::string("vdbshade ") + vsh_version());
    if (grid.info.shell_thickness > 0.0) {
        named->insertMeta(SHELL_THICKNESS, openvdb::DoubleMetadata(grid.info.shell_thickness));
    }
    SinkBuffer buffer(output.file.temporary);
    std::ostream stream(&buffer);
    Writer().put(stream, named);
    stream.seekp(std::streamoff(UUID_AT));
    stream << content_uuid(grid);
    const bool good = stream.good();
    const int number = buffer.finish();
    if (number != 0 || !good) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", path,
                         number != 0 ? std::strerror(number) : "OpenVDB gave no reason");
    }
    return vshi_output_commit(&output.file, error);
}

template <size_t Capacity> void copy_text(char (&to)[Capacity], const std::string &from) {
    std::snprintf(to, Capacity, "%s", from.c_str());
}

void describe(Reader &reader, size_t i, Stage &stage, vsh_vdb_entry &entry) {
    const GridBase::Ptr grid = reader.grid(i);
    copy_text(entry.name, reader.name(i));
    copy_text(entry.type, grid->type());
    copy_text(entry.grid_class, GridBase::gridClassToString(grid->getGridClass()));
    const openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
    for (int axis = 0; axis < 3; ++axis) {
        entry.voxel_size[axis] = grid->voxelSize()[axis];
        entry.index_min[axis] = box.empty() ? 0 : box.min()[axis];
        entry.index_max[axis] = box.empty() ? 0 : box.max()[axis];
    }
    entry.active_voxels = grid->activeVoxelCount();
    entry.bytes = grid->memUsage();
    if (grid->isType<FloatGrid>()) {
        entry.background = double(openvdb::gridPtrCast<FloatGrid>(grid)->background());
    } else if (grid->isType<openvdb::DoubleGrid>()) {
        entry.background = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid)->background();
    }
    Finding finding = examine_kind(*grid);
    if (finding.kind == Finding::FINE) {
        finding = examine_values(*to_floats(grid), stage);
    }
    copy_text(entry.problem, finding.text);
}

vsh_result list(const char *path, vsh_vdb_entry *entries, size_t capacity, size_t *count, vsh_error *error) {
    const vsh_run run = vsh_run_default();
    Reader reader(path, error);
    for (size_t i = 0; i < std::min(capacity, reader.count()); ++i) {
        Stage stage(run, "load", error);
        entries[i] = {};
        describe(reader, i, stage, entries[i]);
    }
    *count = reader.count();
    return VSH_OK;
}

} // namespace

} // namespace vshi

vsh_result vsh_grid_read(const char *path, const char *name, const vsh_run *run, vsh_grid **grid,
                         vsh_error *error) {
    *grid = nullptr;
    vsh_run full;
    const vsh_result result = vshi_run_resolve(run, &full, error);
    if (result != VSH_OK) {
        return result;
    }
    return vshi::guard_file(error, path, [&] { return vshi::read(path, name, full, grid, error); });
}

vsh_result vsh_grid_write(const vsh_grid *grid, const char *path, const char *name, vsh_error *error) {
    return vshi::guard(error, VSH_ERROR_WRITE, path, [&] {
        vshi::initialize();
        return vshi::write(*grid, path, name != nullptr ? name : "surface", error);
    });
}

vsh_result vsh_vdb_list(const char *path, vsh_vdb_entry *entries, size_t capacity, size_t *count,
                        vsh_error *error) {
    *count = 0;
    return vshi::guard_file(error, path, [&] { return vshi::list(path, entries, capacity, count, error); });
}
