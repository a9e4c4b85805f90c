// Parsing .vdb files: level sets, lists, grids of numbers.
//
// The reader of OpenVDB 10.0.1 crashes on some damaged files (it writes past its buffers if Blosc data give a
// wrong size). This code checks positions and sizes, and a short file is an error; it cannot check the packed
// data. Read untrusted files with a reader (vsh_run.reader), which runs this code in its own process.
#include "levelset/file.h"

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <sys/stat.h>

namespace vshi {

void initialize() {
    static const bool once = (openvdb::initialize(), true);
    static_cast<void>(once);
}

namespace {

using openvdb::GridBase;
using openvdb::MetaMap;
using openvdb::io::GridDescriptor;

// --- the grids of a file

constexpr size_t HEADER = UUID_AT + UUID_LENGTH;
constexpr unsigned char MAGIC[8] = {0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0};

// A file's grids in the file's order. OpenVDB's own class for this loads late (a handle to the file would
// linger) and reads past the end of a file that is cut short.
class GridReader final : public openvdb::io::Archive {
  public:
    explicit GridReader(const char *path);

    size_t count() const { return entries.size(); }
    std::string name(size_t i) const { return GridDescriptor::nameAsString(entries[i].uniqueName()); }
    bool is_named(size_t i, const char *wanted) const {
        return name(i) == wanted || entries[i].gridName() == wanted;
    }
    MetaMap metadata(size_t i);
    double bytes(size_t i);               // in memory, as the file says
    GridBase::Ptr without_tree(size_t i); // metadata and transform
    GridBase::Ptr grid(size_t i);

    const char *const path;

  private:
    void open();
    void list();

    uint64_t size = 0;
    // The stream keeps this pointer's address.
    openvdb::io::StreamMetadata::Ptr state = std::make_shared<openvdb::io::StreamMetadata>();
    std::filebuf file;
    std::istream stream{&file};
    std::vector<GridDescriptor> entries;
    std::vector<GridBase::Ptr> grids; // without trees
};

GridReader::GridReader(const char *path_) : path(path_) {
    open();
    stream.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    openvdb::io::setStreamMetadataPtr(stream, state, false);
    readHeader(stream);
    setFormatVersion(stream); // reading depends on these
    setLibraryVersion(stream);
    setDataCompression(stream);
    if (!inputHasGridOffsets()) {
        refuse(VSH_ERROR_READ, "%s: cannot be read: it is a stream, without the places of its grids", path);
    }
    MetaMap().readMeta(stream);
    list();
}

// Refuses a file that is no .vdb file, or that OpenVDB cannot read.
void GridReader::open() {
    const auto refuse_file = [&](const char *reason) {
        refuse(VSH_ERROR_READ, "%s: cannot be read: %s", path, reason);
    };
    struct stat status;
    if (::stat(path, &status) != 0) {
        refuse_file(std::strerror(errno));
    }
    if (!S_ISREG(status.st_mode)) {
        refuse_file(S_ISDIR(status.st_mode) ? "it is a folder" : "it is no regular file");
    }
    if (file.open(path, std::ios::in | std::ios::binary) == nullptr) {
        refuse_file(std::strerror(errno));
    }
    size = uint64_t(status.st_size);
    unsigned char header[HEADER];
    const auto held = size_t(file.sgetn(reinterpret_cast<char *>(header), sizeof header));
    if (std::memcmp(header, MAGIC, std::min(held, sizeof MAGIC)) != 0 || held == 0) {
        refuse_file("it is no OpenVDB file");
    }
    if (held < sizeof header) {
        refuse_file("it is cut short within its header");
    }
    const uint32_t version =
        header[8] | uint32_t(header[9]) << 8 | uint32_t(header[10]) << 16 | uint32_t(header[11]) << 24;
    if (version > openvdb::OPENVDB_FILE_VERSION) {
        refuse(VSH_ERROR_READ, "%s: cannot be read: format version %u, this OpenVDB reads up to %u", path,
               version, uint32_t(openvdb::OPENVDB_FILE_VERSION));
    }
    file.pubseekpos(0);
}

void GridReader::list() {
    const int32_t number = readGridCount(stream);
    for (int32_t i = 0; i < number; ++i) {
        GridDescriptor entry;
        grids.push_back(entry.read(stream));
        entries.push_back(entry);
        const long long begin = entry.getGridPos(), blocks = entry.getBlockPos(), end = entry.getEndPos();
        const std::string name = this->name(size_t(i));
        if (begin < int64_t(HEADER) || end <= stream.tellg() ||
            (!entry.isInstance() && (blocks < begin || end < blocks))) {
            refuse(VSH_ERROR_READ, "%s: damaged: grid '%s' at bytes %lld … %lld", path, name.c_str(), begin,
                   end);
        }
        if (uint64_t(end) > size) {
            refuse(VSH_ERROR_READ, "%s: cut short: grid '%s' ends at byte %lld, the file at %llu", path,
                   name.c_str(), end, static_cast<unsigned long long>(size));
        }
        entry.seekToEnd(stream);
    }
}

MetaMap GridReader::metadata(size_t i) {
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
    entries[i].seekToGrid(stream);
    readGridCompression(stream);
    result->readMeta(stream);
    if (openvdb::io::getFormatVersion(stream) >= openvdb::OPENVDB_FILE_VERSION_GRID_INSTANCING) {
        result->readTransform(stream); // behind the tree in older files
    }
    return result;
}

GridBase::Ptr GridReader::grid(size_t i) {
    const GridDescriptor &entry = entries[i];
    const GridBase::Ptr result = grids[i]->copyGrid();
    entry.seekToGrid(stream);
    readGrid(result, entry, stream);
    if (entry.isInstance()) { // it shares another grid's tree
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

// Calls read(reader) with a file's grids. Reading past the end of the file is an exception whose text does
// not help.
template <typename Read> auto read_file(const char *path, const Read &read) {
    initialize();
    try {
        GridReader reader(path);
        return read(reader);
    } catch (const std::ios_base::failure &) {
        refuse(VSH_ERROR_READ, "%s: cut short or damaged", path);
    }
}

std::string class_of(const MetaMap &metadata) {
    const auto text = metadata.getMetadata<openvdb::StringMetadata>(GridBase::META_GRID_CLASS);
    return text ? text->value() : "";
}

// The first grid of that name, or (nullptr) the first with `wanted(i)`. If there is none such, the first
// grid: its caller refuses it with a reason.
template <typename Wanted> size_t choose(GridReader &reader, const char *name, const Wanted &wanted) {
    if (reader.count() == 0) {
        refuse(VSH_ERROR_INPUT, "%s: holds no grids", reader.path);
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
    refuse(VSH_ERROR_INPUT, "%s: no grid '%s'; it holds %.700s", reader.path, name, names.c_str());
}

// The grid as floats, without its metadata and transform.
FloatGrid::Ptr to_floats(const GridBase::Ptr &grid) {
    FloatTree::Ptr tree;
    if (grid->isType<openvdb::DoubleGrid>()) {
        tree = std::make_shared<FloatTree>(openvdb::gridPtrCast<openvdb::DoubleGrid>(grid)->tree());
    } else {
        tree = openvdb::gridPtrCast<FloatGrid>(grid)->treePtr();
    }
    return FloatGrid::create(tree);
}

bool has_numbers(const GridBase &grid) {
    return grid.apply<NumberGrids>([](const auto &) {});
}

template <size_t Capacity> void copy_text(char (&to)[Capacity], const std::string &from) {
    std::snprintf(to, Capacity, "%s", from.c_str());
    vshi_one_line(to);
}

// The metadata whose names begin with ours, one line each.
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

// The active voxels' box in the file's metadata; empty if there is none.
openvdb::CoordBBox declared_box(const GridBase &grid) {
    const auto low = grid.getMetadata<openvdb::Vec3IMetadata>(GridBase::META_FILE_BBOX_MIN);
    const auto high = grid.getMetadata<openvdb::Vec3IMetadata>(GridBase::META_FILE_BBOX_MAX);
    return low && high ? openvdb::CoordBBox(Coord(low->value()), Coord(high->value())) : openvdb::CoordBBox();
}

// Describes a grid; by its metadata if it is too large to be read.
void describe(GridReader &reader, size_t i, Stage &stage, vsh_vdb_entry &entry) {
    copy_text(entry.name, reader.name(i));
    std::string problem;
    try {
        check_bytes(stage.options, reader.bytes(i), "its values were not read");
    } catch (const Failure &failure) {
        problem = failure.error.message;
    }
    const bool is_read = problem.empty();
    const GridBase::Ptr grid = is_read ? reader.grid(i) : reader.without_tree(i);
    std::snprintf(entry.attributes, sizeof entry.attributes, "%s", attributes_of(*grid).c_str());
    copy_text(entry.type, grid->type());
    copy_text(entry.grid_class, GridBase::gridClassToString(grid->getGridClass()));
    const std::string fault = examine_kind(*grid).text;
    problem = fault.empty() ? problem : fault;
    const openvdb::CoordBBox box = is_read ? grid->evalActiveVoxelBoundingBox() : declared_box(*grid);
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
            const double voxel = axis_of(matrix_of(grid->transform()).data(), 0).length();
            const Finding finding = examine_values(*to_floats(grid), voxel, stage);
            problem = finding.text;
            entry.mended = finding.kind == Finding::ODD;
        }
    } else {
        const auto voxels = grid->getMetadata<openvdb::Int64Metadata>(GridBase::META_FILE_VOXEL_COUNT);
        entry.active_voxels = voxels ? uint64_t(std::max<int64_t>(voxels->value(), 0)) : 0;
        entry.bytes = uint64_t(std::max(reader.bytes(i), 0.0));
    }
    copy_text(entry.problem, problem);
}

} // namespace

double shell_of(const GridBase &grid) {
    const auto shell = grid.getMetadata<openvdb::DoubleMetadata>(SHELL_THICKNESS);
    return shell && std::isfinite(shell->value()) && shell->value() > 0.0 ? shell->value() : 0.0;
}

namespace {

// Whether a grid has no leaf. The tree is read only if the file says that no voxel is active.
bool is_empty(GridReader &reader, size_t i) {
    const auto voxels =
        reader.metadata(i).getMetadata<openvdb::Int64Metadata>(GridBase::META_FILE_VOXEL_COUNT);
    return voxels && voxels->value() == 0 && reader.grid(i)->constBaseTree().leafCount() == 0;
}

struct Choice {
    size_t grid;
    std::string others; // the other level sets, and what is wrong with them
};

// Without a name, chooses the first level set that can cast. If none can, chooses the first: its caller
// refuses it with a reason.
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

LevelSet load_level_set(const char *path, const char *name, Stage &stage) {
    return read_file(path, [&](GridReader &reader) {
        const Choice choice = choose_level_set(reader, name);
        LevelSet loaded{{path, reader.name(choice.grid)}, nullptr, {}, 0.0};
        check_bytes(stage.options, reader.bytes(choice.grid), loaded.name.text().c_str());
        const GridBase::Ptr found = reader.grid(choice.grid);
        refuse_bad(loaded.name, examine_kind(*found));
        loaded.grid = to_floats(found);
        loaded.matrix = matrix_of(found->transform());
        loaded.shell = shell_of(*found);
        if (!choice.others.empty()) {
            vshi_warn(&stage.options,
                      "%s casts; the file's other level sets do not: %.700s; pick one as %s:NAME",
                      loaded.name.text().c_str(), choice.others.c_str(), path);
        }
        return loaded;
    });
}

size_t list_grids(const char *path, const vsh_run &run, std::vector<vsh_vdb_entry> &entries,
                  size_t capacity) {
    return read_file(path, [&](GridReader &reader) {
        for (size_t i = 0; i < std::min(capacity, reader.count()); ++i) {
            Stage stage(run, "load");
            stage.check();
            entries.push_back({});
            describe(reader, i, stage, entries.back());
        }
        return reader.count();
    });
}

GridBase::Ptr read_numbers(const char *path, const char *name, const vsh_run &run) {
    return read_file(path, [&](GridReader &reader) {
        const size_t chosen =
            choose(reader, name, [&](size_t i) { return has_numbers(*reader.without_tree(i)); });
        const std::string what = GridName{path, reader.name(chosen)}.text();
        const GridBase::Ptr bare = reader.without_tree(chosen);
        if (!has_numbers(*bare)) {
            refuse(VSH_ERROR_INPUT, "%s is a %s, expected a grid of numbers", what.c_str(),
                   bare->type().c_str());
        }
        check_bytes(run, reader.bytes(chosen), what.c_str());
        const GridBase::Ptr grid = reader.grid(chosen);
        check_bytes(run, double(grid->memUsage()), what.c_str());
        return grid;
    });
}

} // namespace vshi
