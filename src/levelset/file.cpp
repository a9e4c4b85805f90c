// Parsing .vdb files: level sets, lists, grids of numbers.
//
// The reader of OpenVDB 10.0.1 crashes on some damaged files (it writes past its buffers where Blosc data lie
// about their size): positions and sizes are checked here and a short file shows as an error, but damage
// inside the packed data cannot be seen beforehand. Untrusted files are for a reader (vsh_run.reader), which
// runs this code in a process of its own.
#include "levelset/file.h"

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/Stream.h>
#include <sys/stat.h>
#include <zlib.h>

namespace vshi {

void initialize() {
    static const bool once = (openvdb::initialize(), true);
    static_cast<void>(once);
}

namespace {

using openvdb::GridBase;
using openvdb::MetaMap;
using openvdb::io::GridDescriptor;

// --- the stream that .vdb files are read from

// RFC 1950: deflate, and a multiple of 31. Without it zlib refuses the data, which OpenVDB notices.
bool is_zip(const unsigned char *bytes, size_t size) {
    return size > 2 && (bytes[0] & 15) == 8 && (bytes[0] * 256 + bytes[1]) % 31 == 0;
}

bool fits(unsigned char *bytes, size_t size) {
    unsigned char unpacked[1 << 14];
    z_stream stream{};
    stream.next_in = bytes;
    stream.avail_in = uInt(size);
    if (inflateInit(&stream) != Z_OK) {
        return false;
    }
    int result = Z_OK;
    while (result == Z_OK) {
        stream.next_out = unpacked;
        stream.avail_out = sizeof unpacked;
        result = inflate(&stream, Z_NO_FLUSH);
    }
    inflateEnd(&stream);
    return result == Z_STREAM_END;
}

// Checks the sums (Adler-32, RFC 1950) of a file's Zip data as they are read. OpenVDB 10.0 ignores wrong sums
// and goes on with wrong values. The file gives a size in 8 bytes, then the data in one piece.
class CheckedFile final : public std::filebuf {
  public:
    bool sound() const { return !damaged; }

  protected:
    std::streamsize xsgetn(char *bytes, std::streamsize size) override;

  private:
    int64_t announced = 0; // size that was read last
    bool damaged = false;
};

std::streamsize CheckedFile::xsgetn(char *bytes, std::streamsize size) {
    const std::streamsize read = std::filebuf::xsgetn(bytes, size);
    auto *data = reinterpret_cast<unsigned char *>(bytes);
    if (read == size && size == announced && size < (std::streamsize(1) << 31) &&
        is_zip(data, size_t(size))) {
        damaged = damaged || !fits(data, size_t(size));
    }
    announced = 0;
    if (read == size && size == std::streamsize(sizeof announced)) {
        std::memcpy(&announced, bytes, sizeof announced);
    }
    return read;
}

// --- the grids of a file

constexpr size_t HEADER = UUID_AT + UUID_LENGTH;
constexpr unsigned char MAGIC[8] = {0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0};

// A file's grids in the order in which it holds them. OpenVDB's own class for this loads late (a handle to
// the file would linger) and goes on past the end of a file that is cut short.
class GridReader final : public openvdb::io::Archive {
  public:
    GridReader(const char *path, const vsh_run &run, vsh_error *error);

    size_t count() const { return entries.size(); }
    std::string name(size_t i) const { return GridDescriptor::nameAsString(entries[i].uniqueName()); }
    bool is_named(size_t i, const char *wanted) const {
        return name(i) == wanted || entries[i].gridName() == wanted;
    }
    MetaMap metadata(size_t i);
    double bytes(size_t i);               // in memory, as the file says
    GridBase::Ptr without_tree(size_t i); // metadata and transform
    GridBase::Ptr grid(size_t i);
    bool is_streamed() const { return streamed; }

    const char *const path;
    vsh_error *const error;

  private:
    void open();
    void list();
    GridBase::Ptr read_tree(size_t i);

    uint64_t size = 0;
    // The stream keeps this pointer's address.
    openvdb::io::StreamMetadata::Ptr state = std::make_shared<openvdb::io::StreamMetadata>();
    CheckedFile file;
    std::istream stream{&file};
    std::vector<GridDescriptor> entries;
    std::vector<GridBase::Ptr> grids; // without a tree yet, but for streamed files
    bool streamed = false;
};

GridReader::GridReader(const char *path_, const vsh_run &run, vsh_error *error_)
    : path(path_), error(error_) {
    open();
    stream.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    openvdb::io::setStreamMetadataPtr(stream, state, false);
    readHeader(stream);
    setFormatVersion(stream); // reading depends on these
    setLibraryVersion(stream);
    setDataCompression(stream);
    streamed = !inputHasGridOffsets();
    if (streamed) { // all of it has to be read: at least as much as the file is long
        require(check_bytes(&run, double(size), path, error));
        stream.seekg(0);
        openvdb::io::Stream all(stream, false);
        for (const GridBase::Ptr &one : *all.getGrids()) {
            entries.emplace_back(one->getName(), one->type());
            grids.push_back(one);
        }
    } else {
        MetaMap().readMeta(stream);
        list();
    }
}

// Refuses what is no .vdb file, or none that OpenVDB has a chance to read.
void GridReader::open() {
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
    if (file.open(path, std::ios::in | std::ios::binary) == nullptr) {
        throw fail(std::strerror(errno));
    }
    size = uint64_t(status.st_size);
    unsigned char header[HEADER];
    const auto held = size_t(file.sgetn(reinterpret_cast<char *>(header), sizeof header));
    if (std::memcmp(header, MAGIC, std::min(held, sizeof MAGIC)) != 0 || held == 0) {
        throw fail("it is no OpenVDB file");
    }
    if (held < sizeof header) {
        throw fail("it is cut short within its header");
    }
    const uint32_t version =
        header[8] | uint32_t(header[9]) << 8 | uint32_t(header[10]) << 16 | uint32_t(header[11]) << 24;
    if (version > openvdb::OPENVDB_FILE_VERSION) {
        throw Failure{vshi_fail(error, VSH_ERROR_READ,
                                "%s: cannot be read: format version %u, this OpenVDB reads up to %u", path,
                                version, uint32_t(openvdb::OPENVDB_FILE_VERSION))};
    }
    file.pubseekpos(0);
}

void GridReader::list() {
    const int32_t number = readGridCount(stream);
    for (int32_t i = 0; i < number; ++i) {
        GridDescriptor entry;
        grids.push_back(entry.read(stream));
        const int64_t begin = entry.getGridPos(), blocks = entry.getBlockPos(), end = entry.getEndPos();
        if (begin < int64_t(HEADER) || end <= stream.tellg() ||
            (!entry.isInstance() && (blocks < begin || end < blocks))) {
            throw Failure{vshi_fail(error, VSH_ERROR_READ, "%s: damaged: grid '%s' at bytes %lld … %lld",
                                    path, GridDescriptor::nameAsString(entry.uniqueName()).c_str(),
                                    static_cast<long long>(begin), static_cast<long long>(end))};
        }
        if (uint64_t(end) > size) {
            throw Failure{vshi_fail(error, VSH_ERROR_READ,
                                    "%s: cut short: grid '%s' ends at byte %lld, the file at %llu", path,
                                    GridDescriptor::nameAsString(entry.uniqueName()).c_str(),
                                    static_cast<long long>(end), static_cast<unsigned long long>(size))};
        }
        entries.push_back(entry);
        entry.seekToEnd(stream);
    }
}

MetaMap GridReader::metadata(size_t i) {
    if (streamed) {
        return *grids[i];
    }
    entries[i].seekToGrid(stream);
    readGridCompression(stream);
    MetaMap metadata;
    metadata.readMeta(stream);
    return metadata;
}

double GridReader::bytes(size_t i) {
    const MetaMap known = metadata(i);
    const auto bytes = known.getMetadata<openvdb::Int64Metadata>(GridBase::META_FILE_MEM_BYTES);
    return bytes ? double(bytes->value()) : double(size);
}

GridBase::Ptr GridReader::without_tree(size_t i) {
    const GridBase::Ptr result = grids[i]->copyGrid();
    if (!streamed) {
        entries[i].seekToGrid(stream);
        readGridCompression(stream);
        result->readMeta(stream);
        if (openvdb::io::getFormatVersion(stream) >= openvdb::OPENVDB_FILE_VERSION_GRID_INSTANCING) {
            result->readTransform(stream); // behind the tree in older files
        }
    }
    return result;
}

GridBase::Ptr GridReader::grid(size_t i) {
    const GridBase::Ptr read = streamed ? grids[i] : read_tree(i);
    if (!file.sound()) {
        throw Failure{vshi_fail(error, VSH_ERROR_READ,
                                "%s: damaged: grid '%s': Zip data that do not fit their check sum", path,
                                name(i).c_str())};
    }
    return read;
}

GridBase::Ptr GridReader::read_tree(size_t i) {
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

// --- answers to requests

// Calls read(reader) with a file's grids. Reading past the end of the file shows as an exception whose own
// words are of no use.
template <typename Read>
auto read_file(const char *path, const vsh_run &run, vsh_error *error, const Read &read) {
    initialize();
    try {
        GridReader reader(path, run, error);
        return read(reader);
    } catch (const std::ios_base::failure &) {
        throw Failure{vshi_fail(error, VSH_ERROR_READ, "%s: cut short or damaged", path)};
    }
}

std::string class_of(const MetaMap &metadata) {
    const auto text = metadata.getMetadata<openvdb::StringMetadata>(GridBase::META_GRID_CLASS);
    return text ? text->value() : "";
}

// The first grid of that name, or (nullptr) that `wanted(i)` holds for; else the first one, to be refused
// with its reason.
template <typename Wanted> size_t choose(GridReader &reader, const char *name, const Wanted &wanted) {
    if (reader.count() == 0) {
        throw Failure{vshi_fail(reader.error, VSH_ERROR_INPUT, "%s: holds no grids", reader.path)};
    }
    std::string names;
    for (size_t i = 0; i < reader.count(); ++i) {
        if (name != nullptr ? reader.is_named(i, name) : wanted(i)) {
            return i;
        }
        names += (i > 0 ? ", '" : "'") + reader.name(i) + "'";
    }
    if (name == nullptr) {
        return 0;
    }
    throw Failure{vshi_fail(reader.error, VSH_ERROR_INPUT, "%s: no grid '%s'; it holds %.700s", reader.path,
                            name, names.c_str())};
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
    floats->setTransform(restore_transform(describe_transform(grid->transform())));
    return floats;
}

bool has_numbers(const GridBase &grid) {
    return grid.apply<NumberGrids>([](const auto &) {});
}

template <size_t Capacity> void copy_text(char (&to)[Capacity], const std::string &from) {
    std::snprintf(to, Capacity, "%s", from.c_str());
    vshi_one_line(to);
}

// What begins with our name, one line each.
std::string attributes_of(const MetaMap &metadata) {
    std::string lines;
    for (auto item = metadata.beginMeta(); item != metadata.endMeta(); ++item) {
        if (item->second != nullptr && item->first.compare(0, 9, "vdbshade_") == 0) {
            std::string line = item->first + ": " + item->second->str();
            std::replace_if(
                line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
            lines += line + '\n';
        }
    }
    return lines;
}

// The active voxels' box, by what the file says; empty where it does not.
openvdb::CoordBBox told_box(const GridBase &grid) {
    const auto low = grid.getMetadata<openvdb::Vec3IMetadata>(GridBase::META_FILE_BBOX_MIN);
    const auto high = grid.getMetadata<openvdb::Vec3IMetadata>(GridBase::META_FILE_BBOX_MAX);
    return low && high ? openvdb::CoordBBox(Coord(low->value()), Coord(high->value())) : openvdb::CoordBBox();
}

// Describes a grid. Where it is too large to be read, the metadata must do.
void describe(GridReader &reader, size_t i, Stage &stage, vsh_vdb_entry &entry) {
    copy_text(entry.name, reader.name(i));
    vsh_error over;
    const bool is_read =
        check_bytes(&stage.options, reader.bytes(i), "its values were not read", &over) == VSH_OK;
    const GridBase::Ptr grid = is_read ? reader.grid(i) : reader.without_tree(i);
    std::snprintf(entry.attributes, sizeof entry.attributes, "%s", attributes_of(*grid).c_str());
    copy_text(entry.type, grid->type());
    copy_text(entry.grid_class, GridBase::gridClassToString(grid->getGridClass()));
    std::string problem = examine_kind(*grid).text;
    const openvdb::CoordBBox box = is_read ? grid->evalActiveVoxelBoundingBox() : told_box(*grid);
    for (int axis = 0; axis < 3; ++axis) {
        entry.voxel_size[axis] = grid->voxelSize()[axis];
        entry.index_min[axis] = box.empty() ? 0 : box.min()[axis];
        entry.index_max[axis] = box.empty() ? 0 : box.max()[axis];
    }
    if (is_read) {
        entry.active_voxels = grid->activeVoxelCount();
        entry.bytes = grid->memUsage();
        if (grid->isType<FloatGrid>()) {
            entry.background = double(openvdb::gridPtrCast<FloatGrid>(grid)->background());
        } else if (grid->isType<openvdb::DoubleGrid>()) {
            entry.background = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid)->background();
        }
        if (problem.empty()) {
            const Finding finding = examine_values(*to_floats(grid), stage);
            problem = finding.text;
            entry.mended = finding.kind == Finding::ODD;
        }
    } else {
        const auto voxels = grid->getMetadata<openvdb::Int64Metadata>(GridBase::META_FILE_VOXEL_COUNT);
        entry.active_voxels = voxels ? uint64_t(std::max<int64_t>(voxels->value(), 0)) : 0;
        entry.bytes = uint64_t(std::max(reader.bytes(i), 0.0));
        problem = problem.empty() ? over.message : problem;
    }
    copy_text(entry.problem, problem);
}

} // namespace

void refuse_bad(const Named &named, const Finding &finding, vsh_error *error) {
    if (finding.kind == Finding::BAD) {
        throw Failure{vshi_fail(error, VSH_ERROR_INPUT, "%s cannot cast shadows: %s", named.text().c_str(),
                                finding.text.c_str())};
    }
}

void refuse_large(const Named &named, const vsh_run &run, double bytes, vsh_error *error) {
    require(check_bytes(&run, bytes, named.text().c_str(), error));
}

double shell_of(const GridBase &grid) {
    const auto shell = grid.getMetadata<openvdb::DoubleMetadata>(SHELL_THICKNESS);
    return shell && std::isfinite(shell->value()) && shell->value() > 0.0 ? shell->value() : 0.0;
}

namespace {

// Whether a grid has no leaf. A tree is read only if the file says that no voxel is active.
bool is_empty(GridReader &reader, size_t i) {
    const auto voxels =
        reader.metadata(i).getMetadata<openvdb::Int64Metadata>(GridBase::META_FILE_VOXEL_COUNT);
    const bool suspect = voxels ? voxels->value() == 0 : reader.is_streamed();
    return suspect && reader.grid(i)->constBaseTree().leafCount() == 0;
}

struct Choice {
    size_t grid;
    std::string others; // level sets that were passed over, with what is wrong with them
};

// Without a name the first level set that can cast; else the first, to be refused with its reason.
Choice choose_level_set(GridReader &reader, const char *name) {
    const size_t first = choose(reader, name, [&](size_t i) {
        return class_of(reader.metadata(i)) == GridBase::gridClassToString(openvdb::GRID_LEVEL_SET);
    });
    Choice choice{first, ""};
    bool found = name != nullptr;
    for (size_t i = first; name == nullptr && i < reader.count(); ++i) {
        const GridBase::Ptr bare = reader.without_tree(i);
        if (bare->getGridClass() != openvdb::GRID_LEVEL_SET) {
            continue;
        }
        const Finding kind = examine_kind(*bare);
        const std::string wrong = kind.kind == Finding::BAD ? kind.text
                                  : is_empty(reader, i)     ? "it is empty"
                                                            : "";
        if (!found && wrong.empty()) {
            choice.grid = i;
            found = true;
            continue;
        }
        choice.others += (choice.others.empty() ? "'" : ", '") + reader.name(i) + "'" +
                         (wrong.empty() ? "" : " (" + wrong + ")");
    }
    if (!found) {
        choice.others.clear();
    }
    return choice;
}

} // namespace

LevelSet load_level_set(const char *path, const char *name, Stage &stage, vsh_error *error) {
    return read_file(path, stage.options, error, [&](GridReader &reader) {
        const Choice choice = choose_level_set(reader, name);
        LevelSet loaded{{path, reader.name(choice.grid)}, nullptr, 0.0};
        refuse_large(loaded.named, stage.options, reader.bytes(choice.grid), error);
        const GridBase::Ptr found = reader.grid(choice.grid);
        refuse_bad(loaded.named, examine_kind(*found), error);
        loaded.grid = to_floats(found);
        loaded.shell = shell_of(*found);
        if (!choice.others.empty()) {
            vshi_warn(&stage.options,
                      "%s casts; the file's other level sets do not: %.700s; pick one as %s:NAME",
                      loaded.named.text().c_str(), choice.others.c_str(), path);
        }
        return loaded;
    });
}

size_t list_grids(const char *path, const vsh_run &run, std::vector<vsh_vdb_entry> &entries, size_t capacity,
                  vsh_error *error) {
    return read_file(path, run, error, [&](GridReader &reader) {
        for (size_t i = 0; i < std::min(capacity, reader.count()); ++i) {
            Stage stage(run, "load", error);
            stage.check();
            entries.push_back({});
            describe(reader, i, stage, entries.back());
        }
        return reader.count();
    });
}

GridBase::Ptr read_numbers(const char *path, const char *name, const vsh_run &run, vsh_error *error) {
    return read_file(path, run, error, [&](GridReader &reader) {
        const size_t chosen =
            choose(reader, name, [&](size_t i) { return has_numbers(*reader.without_tree(i)); });
        const Named named{path, reader.name(chosen)};
        const GridBase::Ptr bare = reader.without_tree(chosen);
        if (!has_numbers(*bare)) {
            throw Failure{vshi_fail(error, VSH_ERROR_INPUT, "%s is a %s, expected a grid of numbers",
                                    named.text().c_str(), bare->type().c_str())};
        }
        refuse_large(named, run, reader.bytes(chosen), error);
        const GridBase::Ptr grid = reader.grid(chosen);
        refuse_large(named, run, double(grid->memUsage()), error);
        grid->setTransform(restore_transform(describe_transform(grid->transform())));
        return grid;
    });
}

} // namespace vshi
