// .vdb files: what is written comes back, and what cannot cast shadows is refused with its reason. In C++, to
// write with OpenVDB what the library never would.
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <openvdb/io/File.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <string>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vdbshade/shade.h>
#include <vector>

#include "shim/openvdb.h"

// Last: it has macros named as OpenVDB's members are.
#include <csetjmp>
#include <cstdarg>
#include <cstddef>
#include <cstdint>

extern "C" {
#include <cmocka.h>
}

namespace {

using openvdb::FloatGrid;

std::string folder;

std::string in_folder(const char *name) {
    return folder + "/" + name;
}

std::string content(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void put(const std::string &path, const std::string &bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

vsh_error failure;

void assert_said(vsh_result result, vsh_result expected, std::initializer_list<const char *> parts) {
    if (result != expected) {
        print_error("%d %s\n", result, result != VSH_OK ? failure.message : "");
    }
    assert_int_equal(result, expected);
    for (const char *part : parts) {
        if (std::strstr(failure.message, part) == nullptr) {
            print_error("'%s' is not in '%s'\n", part, failure.message);
        }
        assert_non_null(std::strstr(failure.message, part));
    }
}

constexpr double RADIUS = 1.0, VOXEL = 0.05;

// On one thread: what OpenVDB's own threads do is not this test's.
template <class GridType> typename GridType::Ptr ball(double radius, float half_width) {
    openvdb::util::NullInterrupter *none = nullptr;
    return openvdb::tools::createLevelSetSphere<GridType, openvdb::util::NullInterrupter>(
        float(radius), openvdb::Vec3f(0.0f), float(VOXEL), half_width, none, false);
}

FloatGrid::Ptr sphere(float half_width = 3.0f) {
    const FloatGrid::Ptr grid = ball<FloatGrid>(RADIUS, half_width);
    grid->setName("sphere");
    return grid;
}

std::string save(const char *name, const openvdb::GridPtrVec &grids) {
    const std::string path = in_folder(name);
    openvdb::io::File(path).write(grids);
    return path;
}

vsh_grid *own_sphere() {
    vsh_sdf_node node = vsh_sdf_node_default();
    node.radius = RADIUS;
    const vsh_sdf tree = {&node, 1};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = VOXEL;
    vsh_grid *grid = nullptr;
    assert_int_equal(vsh_grid_from_sdf(&tree, &options, nullptr, &grid, &failure), VSH_OK);
    return grid;
}

std::vector<vshi_leaf> leaves_of(const vsh_grid *grid) {
    std::vector<vshi_leaf> leaves(vshi_grid_leaves(grid, nullptr, 0));
    vshi_grid_leaves(grid, leaves.data(), leaves.size());
    return leaves;
}

void assert_same(const vsh_grid *a, const vsh_grid *b) {
    assert_memory_equal(vshi_grid_transform(a), vshi_grid_transform(b), 12 * sizeof(double));
    const std::vector<vshi_leaf> left = leaves_of(a), right = leaves_of(b);
    assert_int_equal(left.size(), right.size());
    for (size_t i = 0; i < left.size(); ++i) {
        assert_memory_equal(left[i].origin, right[i].origin, sizeof left[i].origin);
        assert_memory_equal(left[i].values, right[i].values, 512 * sizeof(float));
    }
    vsh_grid_info one, other;
    vsh_grid_get_info(a, &one);
    vsh_grid_get_info(b, &other);
    assert_true(one.active_voxels == other.active_voxels && one.half_width == other.half_width &&
                one.shell_thickness == other.shell_thickness);
}

// Largest error in voxels against a sphere at the world's `centre`, over the band.
double worst_error(const vsh_grid *grid, double radius, const openvdb::Vec3d &centre) {
    const double *m = vshi_grid_transform(grid);
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    double worst = 0.0;
    for (const vshi_leaf &leaf : leaves_of(grid)) {
        for (int v = 0; v < 512; ++v) {
            const int index[3] = {leaf.origin[0] + v / 64, leaf.origin[1] + v / 8 % 8,
                                  leaf.origin[2] + v % 8};
            openvdb::Vec3d p;
            for (int row = 0; row < 3; ++row) {
                p[row] = m[4 * row] * index[0] + m[4 * row + 1] * index[1] + m[4 * row + 2] * index[2] +
                         m[4 * row + 3];
            }
            const double band = info.half_width * info.voxel_size;
            const double truth = std::fmax(-band, std::fmin(band, (p - centre).length() - radius));
            worst = std::fmax(worst, std::fabs(double(leaf.values[v]) - truth) / info.voxel_size);
        }
    }
    return worst;
}

struct Warnings {
    std::vector<std::string> lines;
    vsh_run run = vsh_run_default();
    Warnings() {
        run.user = this;
        run.warning = [](void *user, const char *line) {
            static_cast<Warnings *>(user)->lines.emplace_back(line);
        };
    }
};

void refused(const char *file, const openvdb::GridBase::Ptr &grid,
             std::initializer_list<const char *> parts) {
    const std::string path = save(file, {grid});
    vsh_grid *read = nullptr;
    assert_said(vsh_grid_read(path.c_str(), nullptr, nullptr, &read, &failure), VSH_ERROR_INPUT, parts);
    assert_non_null(std::strstr(failure.message, path.c_str()));
    assert_null(read);
    vsh_vdb_entry entry;
    size_t count = 0;
    assert_int_equal(vsh_vdb_list(path.c_str(), nullptr, &entry, 1, &count, &failure), VSH_OK);
    for (const char *part : parts) {
        assert_non_null(std::strstr(entry.problem, part));
    }
}

// ---- Claims ----

void a_written_grid_comes_back_bit_for_bit(void **) {
    vsh_grid *grid = own_sphere(), *back = nullptr;
    const std::string path = in_folder("round.vdb"), again = in_folder("again.vdb");
    assert_int_equal(vsh_grid_write(grid, path.c_str(), nullptr, &failure), VSH_OK);
    Warnings warnings;
    assert_said(vsh_grid_read(path.c_str(), "surface", &warnings.run, &back, &failure), VSH_OK, {});
    assert_true(warnings.lines.empty());
    assert_same(grid, back);
    assert_int_equal(vsh_grid_write(back, again.c_str(), "surface", &failure), VSH_OK);
    assert_true(content(path) == content(again));
    vsh_grid_free(back);
    vsh_grid_free(grid);
}

void openvdb_reads_what_is_written(void **) {
    vsh_grid *grid = own_sphere();
    const std::string path = in_folder("own.vdb");
    assert_int_equal(vsh_grid_write(grid, path.c_str(), "hull", &failure), VSH_OK);
    openvdb::io::File file(path);
    file.open(false);
    const auto read = openvdb::gridPtrCast<FloatGrid>(file.readGrid("hull"));
    assert_int_equal(read->getGridClass(), openvdb::GRID_LEVEL_SET);
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    assert_int_equal(read->activeVoxelCount(), info.active_voxels);
    assert_true(file.compression() != openvdb::io::COMPRESS_NONE);
    vsh_grid_free(grid);
}

void grids_are_listed_and_found_by_name(void **) {
    const FloatGrid::Ptr fog = FloatGrid::create(0.0f), ball = sphere();
    fog->setName("density");
    fog->setGridClass(openvdb::GRID_FOG_VOLUME);
    fog->fill(openvdb::CoordBBox(0, 0, 0, 9, 9, 9), 1.0f);
    const auto vectors = openvdb::Vec3SGrid::create();
    vectors->setName("velocity");
    const std::string path = save("many.vdb", {fog, vectors, ball});
    vsh_vdb_entry entries[3] = {};
    size_t count = 0;
    assert_int_equal(vsh_vdb_list(path.c_str(), nullptr, entries, 3, &count, &failure), VSH_OK);
    assert_int_equal(count, 3);
    assert_string_equal(entries[0].name, "density");
    assert_string_equal(entries[0].grid_class, "fog volume");
    assert_non_null(std::strstr(entries[0].problem, "fog volume"));
    assert_int_equal(entries[0].active_voxels, 1000);
    assert_int_equal(entries[0].index_max[2], 9);
    assert_string_equal(entries[1].type, "Tree_vec3s_5_4_3");
    assert_non_null(std::strstr(entries[1].problem, "Tree_vec3s_5_4_3"));
    assert_string_equal(entries[2].name, "sphere");
    assert_string_equal(entries[2].problem, "");
    assert_true(std::fabs(entries[2].background - 3.0 * VOXEL) < 1e-6 && entries[2].bytes > 10000);
    assert_int_equal(vsh_vdb_list(path.c_str(), nullptr, nullptr, 0, &count, &failure), VSH_OK);
    assert_int_equal(count, 3);

    vsh_grid *grid = nullptr; // NULL: the first level set
    assert_said(vsh_grid_read(path.c_str(), nullptr, nullptr, &grid, &failure), VSH_OK, {});
    vsh_grid_free(grid);
    assert_said(vsh_grid_read(path.c_str(), "Sphere", nullptr, &grid, &failure), VSH_ERROR_INPUT,
                {path.c_str(), "'Sphere'", "'density', 'velocity', 'sphere'"});
}

void what_is_no_vdb_file_is_not_read(void **) {
    vsh_grid *grid = nullptr;
    const std::string path = in_folder("not.vdb");
    const auto read = [&](const std::string &at, const char *part) {
        assert_said(vsh_grid_read(at.c_str(), nullptr, nullptr, &grid, &failure), VSH_ERROR_READ,
                    {at.c_str(), part});
        size_t count;
        assert_said(vsh_vdb_list(at.c_str(), nullptr, nullptr, 0, &count, &failure), VSH_ERROR_READ,
                    {at.c_str(), part});
    };
    read(path, std::strerror(ENOENT));
    read(folder, "folder");
    put(path, "");
    read(path, "no OpenVDB file");
    put(path, "v 0 0 0\n");
    read(path, "no OpenVDB file");
    put(path, content(save("whole.vdb", {sphere()})).substr(0, 40));
    read(path, "cut short");
}

void a_cut_file_is_an_error_at_every_length(void **) {
    const std::string whole_path = in_folder("plain.vdb"), path = in_folder("cut.vdb");
    openvdb::io::File file(whole_path);
    file.setCompression(openvdb::io::COMPRESS_NONE);
    file.write(openvdb::GridPtrVec{sphere()});
    const std::string whole = content(whole_path);
    int crashes = 0;
    for (size_t length = 0; length < whole.size(); length += length < 700 ? 13 : whole.size() / 37) {
        put(path, whole.substr(0, length));
        const pid_t child = fork();
        if (child == 0) {
            vsh_grid *grid = nullptr;
            _exit(vsh_grid_read(path.c_str(), nullptr, nullptr, &grid, &failure));
        }
        int status = 0;
        waitpid(child, &status, 0);
        crashes += !WIFEXITED(status);
        assert_true(!WIFEXITED(status) || WEXITSTATUS(status) == VSH_ERROR_READ);
    }
    assert_int_equal(crashes, 0);
}

void what_casts_no_shadows_is_refused(void **) {
    FloatGrid::Ptr grid = sphere();
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    refused("fog.vdb", grid, {"fog volume", "level set"});
    grid = sphere();
    grid->transform().preScale(openvdb::Vec3d(1.0, 2.0, 1.0));
    refused("uneven.vdb", grid, {"0.05 x 0.1 x 0.05", "unevenly"});
    grid = sphere();
    grid->transform().postShear(0.5, openvdb::math::X_AXIS, openvdb::math::Y_AXIS);
    refused("shear.vdb", grid, {""});
    grid = FloatGrid::create(0.15f);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    refused("empty.vdb", grid, {"holds no surface"});
    grid = sphere();
    grid->tree().setValueOn(openvdb::Coord(20, 0, 0), std::numeric_limits<float>::quiet_NaN());
    refused("nan.vdb", grid, {"nan", "(20, 0, 0)"});
    grid = sphere();
    for (auto value = grid->beginValueAll(); value; ++value) {
        value.setValue(-*value);
    }
    refused("inverted.vdb", grid, {"outside is negative"});
}

void turned_and_mirrored_grids_stay_where_they_are(void **) {
    const FloatGrid::Ptr grid = sphere();
    grid->transform().postRotate(0.7, openvdb::math::Y_AXIS);
    grid->transform().postScale(openvdb::Vec3d(-2.0, 2.0, 2.0));
    grid->transform().postTranslate(openvdb::Vec3d(5.0, -3.0, 100.0));
    for (auto value = grid->beginValueAll(); value; ++value) {
        value.setValue(2.0f * *value);
    }
    openvdb::tools::changeBackground(grid->tree(), 2.0f * grid->background());
    const std::string path = save("turned.vdb", {grid}), copy = in_folder("turned2.vdb");
    vsh_grid *read = nullptr, *back = nullptr;
    Warnings warnings;
    assert_said(vsh_grid_read(path.c_str(), nullptr, &warnings.run, &read, &failure), VSH_OK, {});
    assert_true(warnings.lines.empty());
    assert_true(worst_error(read, 2.0 * RADIUS, openvdb::Vec3d(5.0, -3.0, 100.0)) < 0.01);
    assert_int_equal(vsh_grid_write(read, copy.c_str(), nullptr, &failure), VSH_OK);
    assert_said(vsh_grid_read(copy.c_str(), nullptr, nullptr, &back, &failure), VSH_OK, {});
    assert_same(read, back);
    vsh_grid_free(back);
    vsh_grid_free(read);
}

void doubles_are_read(void **) {
    const auto grid = ball<openvdb::DoubleGrid>(RADIUS, 4.0f);
    const std::string path = save("double.vdb", {grid});
    vsh_grid *read = nullptr;
    assert_said(vsh_grid_read(path.c_str(), nullptr, nullptr, &read, &failure), VSH_OK, {});
    assert_true(worst_error(read, RADIUS, openvdb::Vec3d(0.0)) < 0.01);
    vsh_grid_free(read);
}

void values_that_are_no_distances_are_made_so(void **) {
    const FloatGrid::Ptr scaled = sphere(), turned = sphere(2.0f), wide = sphere();
    for (auto value = scaled->beginValueAll(); value; ++value) {
        value.setValue(0.3f * *value); // the background stays
    }
    turned->transform().postRotate(0.7, openvdb::math::Y_AXIS);
    turned->transform().postTranslate(openvdb::Vec3d(1.0, 2.0, 3.0));
    openvdb::tools::changeLevelSetBackground(wide->tree(), float(9.0 * VOXEL));
    const struct {
        FloatGrid::Ptr grid;
        const char *reason;
        openvdb::Vec3d centre;
    } cases[] = {{scaled, "", openvdb::Vec3d(0.0)},
                 {turned, "half width of 2 voxels", openvdb::Vec3d(1.0, 2.0, 3.0)},
                 {wide, "before they reach the background", openvdb::Vec3d(0.0)}};
    for (const auto &one : cases) {
        const std::string path = save("odd.vdb", {one.grid});
        Warnings warnings;
        vsh_grid *read = nullptr;
        assert_said(vsh_grid_read(path.c_str(), nullptr, &warnings.run, &read, &failure), VSH_OK, {});
        assert_int_equal(warnings.lines.size(), 1);
        assert_non_null(std::strstr(warnings.lines[0].c_str(), one.reason));
        assert_true(worst_error(read, RADIUS, one.centre) < 0.1);
        vsh_grid_free(read);
    }
}

// Shadows under the sphere, seen as the reader left it.
std::vector<float> shadows_of(const vsh_grid *grid) {
    vsh_field *field = nullptr;
    assert_said(vsh_field_create(grid, nullptr, nullptr, &field, &failure), VSH_OK, {});
    std::vector<double> positions;
    for (int i = 0; i < 60; ++i) {
        positions.insert(positions.end(), {0.03 * i, -2.5, 0.01});
    }
    vsh_light light = vsh_light_default();
    light.angle = 0.2;
    const vsh_points points = {positions.size() / 3, positions.data(), nullptr, nullptr};
    std::vector<float> visible(points.count);
    assert_said(vsh_shade_shadow(field, &points, &light, nullptr, nullptr, visible.data(), nullptr, nullptr,
                                 &failure),
                VSH_OK, {});
    vsh_field_free(field);
    return visible;
}

// Bands of other widths too: narrower ones than 3 voxels are made anew.
void scaled_values_and_narrow_bands_cast_the_same_shadows(void **) {
    vsh_grid *own = own_sphere();
    const std::vector<float> expected = shadows_of(own);
    vsh_grid_free(own);
    const struct {
        float factor, half_width;
        size_t warnings;
    } cases[] = {{1.0f, 3.0f, 0},   {2.0f, 3.0f, 1},  {0.5f, 3.0f, 1}, {0.5f, 10.0f, 1}, {2.0f, 10.0f, 1},
                 {1.0f, 100.0f, 0}, {1.0f, 1.25f, 1}, {1.0f, 2.0f, 1}, {16.0f, 3.0f, 1}, {0.01f, 5.0f, 1}};
    for (const auto &one : cases) {
        const FloatGrid::Ptr grid = sphere(one.half_width);
        for (auto value = grid->beginValueAll(); value; ++value) {
            value.setValue(one.factor * *value);
        }
        openvdb::tools::changeBackground(grid->tree(), one.factor * grid->background());
        const std::string path = save("scaled.vdb", {grid});
        Warnings warnings;
        vsh_grid *read = nullptr;
        assert_said(vsh_grid_read(path.c_str(), nullptr, &warnings.run, &read, &failure), VSH_OK, {});
        assert_int_equal(warnings.lines.size(), one.warnings);
        const std::vector<float> visible = shadows_of(read);
        float worst = 0.0f;
        for (size_t i = 0; i < visible.size(); ++i) {
            worst = std::max(worst, std::fabs(visible[i] - expected[i]));
        }
        print_message("values times %g, half width %g: shadows %.4f apart at most\n", double(one.factor),
                      double(one.half_width), double(worst));
        assert_true(worst < 0.03f);
        vsh_grid_free(read);
    }
}

void what_is_all_inside_is_refused(void **) {
    const FloatGrid::Ptr grid = sphere(), inside = sphere();
    for (auto value = grid->beginValueAll(); value; ++value) {
        value.setValue(-std::fabs(*value));
    }
    refused("inside.vdb", grid, {"no value is above 0"});
    for (auto value = inside->beginValueAll(); value; ++value) {
        value.setValue(-std::fabs(*value));
    }
    inside->tree().root().setBackground(-inside->background(), false);
    refused("inside.vdb", inside, {"outside must be positive"});
}

void voxels_too_small_for_openvdb_are_refused_and_the_least_come_back(void **) {
    for (const double voxel : {1e-12, 1.44e-5, 1.46e-5, 1e12}) {
        vsh_sdf_node node = vsh_sdf_node_default();
        node.radius = RADIUS;
        node.scale = voxel / VOXEL;
        const vsh_sdf tree = {&node, 1};
        vsh_grid_options options = vsh_grid_options_default();
        options.voxel_size = voxel;
        vsh_grid *grid = nullptr, *back = nullptr;
        assert_said(vsh_grid_from_sdf(&tree, &options, nullptr, &grid, &failure), VSH_OK, {});
        const std::string path = in_folder("tiny.vdb");
        Warnings warnings;
        const vsh_result result = vsh_grid_write(grid, path.c_str(), nullptr, &failure);
        if (voxel < 1.45e-5) {
            assert_said(result, VSH_ERROR_LIMIT, {path.c_str(), "1.45e-05"});
        } else {
            assert_said(result, VSH_OK, {});
            assert_said(vsh_grid_read(path.c_str(), nullptr, &warnings.run, &back, &failure), VSH_OK, {});
            assert_true(warnings.lines.empty());
            assert_same(grid, back);
        }
        vsh_grid_free(back);
        vsh_grid_free(grid);
    }
}

void the_memory_limit_holds_for_reading(void **) {
    const std::string path = save("limit.vdb", {sphere()});
    vsh_run run = vsh_run_default();
    run.memory_limit = 100000;
    vsh_grid *read = nullptr;
    assert_said(vsh_grid_read(path.c_str(), nullptr, &run, &read, &failure), VSH_ERROR_LIMIT, {path.c_str()});
}

// A sphere of 2 voxels' band, which is measured again.
FloatGrid::Ptr narrow_sphere(const char *name, float radius) {
    const FloatGrid::Ptr grid = ball<FloatGrid>(double(radius), 2.0f);
    grid->setName(name);
    return grid;
}

void making_distances_anew_names_the_file_and_the_grid(void **) {
    const FloatGrid::Ptr narrow = narrow_sphere("hull", 3.0f), wide = sphere();
    const std::string path = save("narrow.vdb", {narrow});
    vsh_run run = vsh_run_default();
    run.memory_limit = 3 * narrow->memUsage(); // to read it, and no more
    vsh_grid *read = nullptr;
    assert_said(vsh_grid_read(path.c_str(), nullptr, &run, &read, &failure), VSH_ERROR_LIMIT,
                {path.c_str(), "grid 'hull'", "voxel size 0.05", "over the memory limit"});
    assert_null(read);

    // Distances that end at 3 voxels, but say 40: the band that is made is foretold, not the one that is
    // there.
    openvdb::tools::changeLevelSetBackground(wide->tree(), float(40.0 * VOXEL));
    wide->setName("wide");
    const std::string wide_path = save("wide.vdb", {wide});
    run.memory_limit = 4 * wide->memUsage();
    assert_said(vsh_grid_read(wide_path.c_str(), nullptr, &run, &read, &failure), VSH_ERROR_LIMIT,
                {wide_path.c_str(), "grid 'wide'", "over the memory limit"});
    run.memory_limit = 1000000000;
    assert_said(vsh_grid_read(wide_path.c_str(), nullptr, &run, &read, &failure), VSH_OK, {});
    vsh_grid_info info;
    vsh_grid_get_info(read, &info);
    assert_true(info.active_voxels > 4 * wide->activeVoxelCount());
    vsh_grid_free(read);
}

void grids_over_the_limit_are_listed_by_what_the_file_says(void **) {
    const FloatGrid::Ptr small = narrow_sphere("small", 0.3f), large = narrow_sphere("large", 4.0f);
    const FloatGrid::Ptr fog = large->deepCopy();
    fog->setName("fog");
    fog->setGridClass(openvdb::GRID_FOG_VOLUME);
    const std::string path = save("limits.vdb", {small, large, fog});
    vsh_vdb_entry all[3] = {}, some[3] = {};
    size_t count = 0;
    assert_int_equal(vsh_vdb_list(path.c_str(), nullptr, all, 3, &count, &failure), VSH_OK);
    vsh_run run = vsh_run_default();
    run.memory_limit = large->memUsage() / 2;
    assert_int_equal(vsh_vdb_list(path.c_str(), &run, some, 3, &count, &failure), VSH_OK);
    assert_int_equal(count, 3);
    assert_memory_equal(&some[0], &all[0], sizeof all[0]);
    for (int i = 1; i < 3; ++i) {
        assert_string_equal(some[i].name, all[i].name);
        assert_string_equal(some[i].type, all[i].type);
        assert_string_equal(some[i].grid_class, all[i].grid_class);
        assert_memory_equal(some[i].voxel_size, all[i].voxel_size, sizeof all[i].voxel_size);
        assert_memory_equal(some[i].index_min, all[i].index_min, sizeof all[i].index_min);
        assert_memory_equal(some[i].index_max, all[i].index_max, sizeof all[i].index_max);
        assert_true(some[i].active_voxels == all[i].active_voxels && some[i].bytes > run.memory_limit);
    }
    assert_non_null(std::strstr(some[1].problem, "not read"));
    assert_non_null(std::strstr(some[1].problem, "over the memory limit"));
    assert_non_null(std::strstr(some[2].problem, "fog volume"));

    std::ofstream stream(in_folder("streamed.vdb"), std::ios::binary); // no offsets: has to be read whole
    openvdb::io::Stream(stream).write(openvdb::GridPtrVec{small, large});
    stream.close();
    run.memory_limit = 1000;
    const std::string streamed = in_folder("streamed.vdb");
    assert_said(vsh_vdb_list(streamed.c_str(), &run, some, 3, &count, &failure), VSH_ERROR_LIMIT,
                {streamed.c_str()});
    assert_int_equal(count, 0);
    assert_int_equal(vsh_vdb_list(streamed.c_str(), nullptr, some, 3, &count, &failure), VSH_OK);
    assert_int_equal(count, 2);
}

void listing_can_be_cancelled(void **) {
    const std::string path = save("stop.vdb", {sphere()});
    vsh_run run = vsh_run_default();
    run.progress = [](void *, const char *, double) { return int32_t(1); };
    vsh_vdb_entry entry;
    size_t count = 1;
    assert_said(vsh_vdb_list(path.c_str(), &run, &entry, 1, &count, &failure), VSH_ERROR_CANCELLED, {});
    assert_int_equal(count, 0);
}

void a_full_disk_leaves_the_old_file(void **) {
    vsh_grid *grid = own_sphere();
    const std::string path = in_folder("full.vdb");
    put(path, "old");
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit old;
    getrlimit(RLIMIT_FSIZE, &old);
    for (const rlim_t bytes : {rlim_t(0), rlim_t(100), rlim_t(20000)}) {
        const rlimit small = {bytes, old.rlim_max};
        setrlimit(RLIMIT_FSIZE, &small);
        const vsh_result result = vsh_grid_write(grid, path.c_str(), nullptr, &failure);
        setrlimit(RLIMIT_FSIZE, &old);
        assert_said(result, VSH_ERROR_WRITE, {path.c_str(), std::strerror(EFBIG)});
        assert_string_equal(content(path).c_str(), "old");
    }
    assert_said(vsh_grid_write(grid, in_folder("no/where.vdb").c_str(), nullptr, &failure), VSH_ERROR_WRITE,
                {"no/where.vdb"});
    vsh_grid_free(grid);
}

int remove_folder(void **) {
    return std::system(("rm -r '" + folder + "'").c_str());
}

} // namespace

int main() {
    const char *place = std::getenv("TMPDIR");
    folder = std::string(place != nullptr ? place : ".") + "/vdbshade-grid-file-XXXXXX";
    if (mkdtemp(folder.data()) == nullptr) {
        return 1;
    }
    openvdb::initialize();
    const CMUnitTest tests[] = {
        cmocka_unit_test(a_cut_file_is_an_error_at_every_length), // first: it forks, before there are threads
        cmocka_unit_test(a_written_grid_comes_back_bit_for_bit),
        cmocka_unit_test(openvdb_reads_what_is_written),
        cmocka_unit_test(grids_are_listed_and_found_by_name),
        cmocka_unit_test(what_is_no_vdb_file_is_not_read),
        cmocka_unit_test(what_casts_no_shadows_is_refused),
        cmocka_unit_test(turned_and_mirrored_grids_stay_where_they_are),
        cmocka_unit_test(doubles_are_read),
        cmocka_unit_test(values_that_are_no_distances_are_made_so),
        cmocka_unit_test(scaled_values_and_narrow_bands_cast_the_same_shadows),
        cmocka_unit_test(what_is_all_inside_is_refused),
        cmocka_unit_test(voxels_too_small_for_openvdb_are_refused_and_the_least_come_back),
        cmocka_unit_test(the_memory_limit_holds_for_reading),
        cmocka_unit_test(making_distances_anew_names_the_file_and_the_grid),
        cmocka_unit_test(grids_over_the_limit_are_listed_by_what_the_file_says),
        cmocka_unit_test(listing_can_be_cancelled),
        cmocka_unit_test(a_full_disk_leaves_the_old_file),
    };
    return cmocka_run_group_tests(tests, nullptr, remove_folder);
}
