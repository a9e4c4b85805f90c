// What .vdb files hold, by a GridReader: level sets, lists, grids of numbers.
#include "levelset/file.h"

#include "levelset/grid_reader.h"

#include <cmath>
#include <cstdio>
#include <cstring>

namespace vshi {

void initialize() {
    static const bool once = (openvdb::initialize(), true);
    static_cast<void>(once);
}

namespace {

using openvdb::GridBase;
using openvdb::MetaMap;

bool has_leaves(const GridBase &grid) {
    return grid.constBaseTree().leafCount() > 0;
}

vsh_result fail_cut_short(const char *path, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: cut short or damaged", path);
}

// Reading past the end of the file shows as this exception, whose own words are of no use.
std::string class_of(const MetaMap &metadata) {
    const auto text = metadata.getMetadata<openvdb::StringMetadata>(GridBase::META_GRID_CLASS);
    return text ? text->value() : "";
}

// The first grid of that name, or (nullptr) that `wanted(i)` holds for; else the first one, to be refused
// with its reason.
template <typename Wanted>
size_t choose(GridReader &reader, const char *path, const char *name, vsh_error *error, Wanted &&wanted) {
    if (reader.count() == 0) {
        throw Failure{vshi_fail(error, VSH_ERROR_INPUT, "%s: holds no grids", path)};
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
    throw Failure{
        vshi_fail(error, VSH_ERROR_INPUT, "%s: no grid '%s'; it holds %.700s", path, name, names.c_str())};
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

void describe_kind(const GridBase &grid, vsh_vdb_entry &entry) {
    std::snprintf(entry.attributes, sizeof entry.attributes, "%s", attributes_of(grid).c_str());
    copy_text(entry.type, grid.type());
    copy_text(entry.grid_class, GridBase::gridClassToString(grid.getGridClass()));
    for (int axis = 0; axis < 3; ++axis) {
        entry.voxel_size[axis] = grid.voxelSize()[axis];
    }
    copy_text(entry.problem, examine_kind(grid).text);
}

void describe_box(const openvdb::CoordBBox &box, vsh_vdb_entry &entry) {
    for (int axis = 0; axis < 3; ++axis) {
        entry.index_min[axis] = box.empty() ? 0 : box.min()[axis];
        entry.index_max[axis] = box.empty() ? 0 : box.max()[axis];
    }
}

// The active voxels' box, by what the file says; empty where it does not.
openvdb::CoordBBox told_box(const GridBase &grid) {
    const auto low = grid.getMetadata<openvdb::Vec3IMetadata>(GridBase::META_FILE_BBOX_MIN);
    const auto high = grid.getMetadata<openvdb::Vec3IMetadata>(GridBase::META_FILE_BBOX_MAX);
    return low && high ? openvdb::CoordBBox(Coord(low->value()), Coord(high->value())) : openvdb::CoordBBox();
}

// What the file says of a grid that is too large to be read.
void describe_unread(GridReader &reader, size_t i, const char *why, vsh_vdb_entry &entry) {
    const GridBase::Ptr grid = reader.without_tree(i);
    describe_kind(*grid, entry);
    const auto voxels = grid->getMetadata<openvdb::Int64Metadata>(GridBase::META_FILE_VOXEL_COUNT);
    describe_box(told_box(*grid), entry);
    entry.active_voxels = voxels ? uint64_t(std::max<int64_t>(voxels->value(), 0)) : 0;
    entry.bytes = uint64_t(std::max(reader.bytes(i), 0.0));
    if (entry.problem[0] == '\0') {
        copy_text(entry.problem, why);
    }
}

void describe(GridReader &reader, size_t i, const char *path, const vsh_run &run, Stage &stage,
              vsh_vdb_entry &entry, vsh_error *error) {
    copy_text(entry.name, reader.name(i));
    vsh_error over;
    if (check_bytes(&run, reader.bytes(i), "its values were not read", &over) != VSH_OK) {
        describe_unread(reader, i, over.message, entry);
        return;
    }
    const GridBase::Ptr grid = reader.grid(i, path, error);
    describe_kind(*grid, entry);
    describe_box(grid->evalActiveVoxelBoundingBox(), entry);
    entry.active_voxels = grid->activeVoxelCount();
    entry.bytes = grid->memUsage();
    if (grid->isType<FloatGrid>()) {
        entry.background = double(openvdb::gridPtrCast<FloatGrid>(grid)->background());
    } else if (grid->isType<openvdb::DoubleGrid>()) {
        entry.background = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid)->background();
    }
    if (entry.problem[0] == '\0') {
        const Finding finding = examine_values(*to_floats(grid), stage);
        copy_text(entry.problem, finding.text);
        entry.mended = finding.kind == Finding::ODD;
    }
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
bool is_empty(GridReader &reader, size_t i, const char *path, vsh_error *error) {
    const auto voxels =
        reader.metadata(i).getMetadata<openvdb::Int64Metadata>(GridBase::META_FILE_VOXEL_COUNT);
    const bool suspect = voxels ? voxels->value() == 0 : reader.is_streamed();
    return suspect && !has_leaves(*reader.grid(i, path, error));
}

struct Choice {
    size_t grid;
    std::string others; // level sets that were passed over, with what is wrong with them
};

// Without a name the first level set that can cast; else the first, to be refused with its reason.
Choice choose_level_set(GridReader &reader, const char *path, const char *name, vsh_error *error) {
    const size_t first = choose(reader, path, name, error, [&](size_t i) {
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
        const std::string wrong = kind.kind == Finding::BAD          ? kind.text
                                  : is_empty(reader, i, path, error) ? "it is empty"
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
    initialize();
    try {
        GridReader reader(path, stage.options, error);
        const Choice choice = choose_level_set(reader, path, name, error);
        const size_t chosen = choice.grid;
        LevelSet loaded{{path, reader.name(chosen)}, nullptr, 0.0};
        refuse_large(loaded.named, stage.options, reader.bytes(chosen), error);
        const GridBase::Ptr found = reader.grid(chosen, path, error);
        refuse_bad(loaded.named, examine_kind(*found), error);
        loaded.grid = to_floats(found);
        loaded.shell = shell_of(*found);
        if (!choice.others.empty()) {
            vshi_warn(&stage.options,
                      "%s casts; the file's other level sets do not: %.700s; pick one as %s:NAME",
                      loaded.named.text().c_str(), choice.others.c_str(), path);
        }
        return loaded;
    } catch (const std::ios_base::failure &) {
        throw Failure{fail_cut_short(path, error)};
    }
}

void list_grids(const char *path, const vsh_run &run, std::vector<vsh_vdb_entry> &entries, size_t capacity,
                size_t &count, vsh_error *error) {
    initialize();
    try {
        GridReader reader(path, run, error);
        for (size_t i = 0; i < std::min(capacity, reader.count()); ++i) {
            Stage stage(run, "load", error);
            stage.check();
            entries.push_back({});
            describe(reader, i, path, run, stage, entries.back(), error);
        }
        count = reader.count();
    } catch (const std::ios_base::failure &) {
        throw Failure{fail_cut_short(path, error)};
    }
}

GridBase::Ptr read_numbers(const char *path, const char *name, const vsh_run &run, vsh_error *error) {
    initialize();
    try {
        GridReader reader(path, run, error);
        const size_t chosen =
            choose(reader, path, name, error, [&](size_t i) { return has_numbers(*reader.without_tree(i)); });
        const Named named{path, reader.name(chosen)};
        const GridBase::Ptr bare = reader.without_tree(chosen);
        if (!has_numbers(*bare)) {
            throw Failure{vshi_fail(error, VSH_ERROR_INPUT, "%s is a %s, expected a grid of numbers",
                                    named.text().c_str(), bare->type().c_str())};
        }
        refuse_large(named, run, reader.bytes(chosen), error);
        const GridBase::Ptr grid = reader.grid(chosen, path, error);
        refuse_large(named, run, double(grid->memUsage()), error);
        grid->setTransform(restore_transform(describe_transform(grid->transform())));
        return grid;
    } catch (const std::ios_base::failure &) {
        throw Failure{fail_cut_short(path, error)};
    }
}

} // namespace vshi
