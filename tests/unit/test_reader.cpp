// Files parsed by a reader give the same bits as in this process, which survives all failures of the reader.
#include "readers.h"

#include <dirent.h>

#include <openvdb/tools/LevelSetSphere.h>
#include <sys/resource.h>

#include <malloc.h>

extern "C" {
#include "io/lit/work.h"
}

// Last: it has macros named as OpenVDB's members are.
#include "testing.h"

namespace {

const std::string ASSETS = VSH_ASSETS, FONT = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";

std::string ball_file() {
    return save("ball.vdb", {sphere()});
}

// --- the same bits

// A handle read in this process, and one read by a reader.
template <typename Handle> struct Both {
    Handle *here = nullptr, *there = nullptr;
    void (*const release)(Handle *);

    template <typename Read> Both(void (*free)(Handle *), Read &&read) : release(free) {
        for (Handle **place : {&here, &there}) {
            const vsh_run run = with_reader(place == &there);
            assert_int_equal(read(&run, place), VSH_OK);
        }
    }
    ~Both() {
        release(here);
        release(there);
    }
};

Both<vsh_grid> both_grids(const std::string &path) {
    return {vsh_grid_free, [&](const vsh_run *run, vsh_grid **grid) {
                return vsh_grid_read(path.c_str(), nullptr, run, grid, &failure);
            }};
}

template <typename Info> void assert_same_info(const Info &here, const Info &there) {
    assert_memory_equal(&here, &there, sizeof here);
}

TEST(grids_are_the_same_for_every_kind_of_transform) {
    using namespace openvdb::math;
    Mat4d turned = Mat4d::identity();
    turned.setToRotation(openvdb::Vec3d(1.0, 2.0, -0.5), 0.7);
    Mat4d affine = turned;
    affine.preScale(openvdb::Vec3d(-0.05));
    affine.setTranslation(openvdb::Vec3d(1e3, -7.0, 0.1));
    const MapBase::Ptr maps[] = {
        MapBase::Ptr(new TranslationMap(openvdb::Vec3d(0.1, 0.2, 0.3))),
        MapBase::Ptr(new ScaleMap(openvdb::Vec3d(0.05, -0.05, 0.05))),
        MapBase::Ptr(new UniformScaleMap(0.05)),
        MapBase::Ptr(new UniformScaleTranslateMap(0.05, openvdb::Vec3d(1.0 / 3.0))),
        MapBase::Ptr(new ScaleTranslateMap(openvdb::Vec3d(-0.05, 0.05, 0.05), openvdb::Vec3d(0.0, 1.0, 0.0))),
        MapBase::Ptr(new UnitaryMap(turned.getMat3())),
        MapBase::Ptr(new AffineMap(affine)),
    };
    for (const MapBase::Ptr &map : maps) {
        const FloatGrid::Ptr grid = sphere();
        grid->setTransform(std::make_shared<Transform>(map));
        warned.clear();
        const Both<vsh_grid> read = both_grids(save("map.vdb", {grid}));
        assert_same(read.here, read.there);
        const size_t half = warned.size() / 2; // each said the same
        assert_true(warned.size() % 2 == 0 &&
                    std::equal(warned.begin(), warned.begin() + long(half), warned.begin() + long(half)));
        assert_same_info(read.here->info, read.there->info);
        const openvdb::Vec3d at(0.3, -0.4, 0.5); // the inverse of the map is not in the info
        assert_true(read.here->level_set->transform().worldToIndex(at) ==
                    read.there->level_set->transform().worldToIndex(at));
    }
}

TEST(mended_grids_and_doubles_and_tiles_are_the_same) {
    const FloatGrid::Ptr narrow = ball<FloatGrid>(RADIUS, 2.0f);
    const FloatGrid::Ptr tiled = sphere();
    tiled->tree().addTile(3, openvdb::Coord(1 << 13, 0, 0), tiled->background(), false);
    tiled->tree().addTile(2, openvdb::Coord(1 << 14, 0, 0), tiled->background(), true);
    tiled->tree().addTile(1, openvdb::Coord(-(1 << 14), 8, 0), -tiled->background(), false);
    const FloatGrid::Ptr wide = ball<FloatGrid>(9.0, 3.0f); // with tiles inside
    const openvdb::DoubleGrid::Ptr doubles = ball<openvdb::DoubleGrid>(RADIUS, 3.0f);
    doubles->setName("doubles");
    const openvdb::GridPtrVec grids{narrow, tiled, wide, doubles};
    for (const openvdb::GridBase::Ptr &grid : grids) {
        const Both<vsh_grid> read = both_grids(save("kind.vdb", {grid}));
        assert_same(read.here, read.there);
        assert_true(read.here->level_set->tree().hasSameTopology(read.there->level_set->tree()));
        assert_int_equal(read.here->info.bytes, read.there->info.bytes);
    }
}

// A file with masked materials, an image beside it and one within, and three kinds of lights.
std::string materials_file() {
    const std::string path = in_folder("materials.gltf");
    put(path, R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1, 2, 3]}],
"nodes": [{"mesh": 0}, {"name": "key", "rotation": [0, 0.6, 0, 0.8], "extensions": {"KHR_lights_punctual": {"light": 0}}},
    {"name": "lamp", "translation": [1, 2, 3], "extensions": {"KHR_lights_punctual": {"light": 1}}},
    {"name": "spot", "translation": [4, 5, 6], "extensions": {"KHR_lights_punctual": {"light": 2}}}],
"extensions": {"KHR_lights_punctual": {"lights": [{"type": "directional", "color": [1, 0.5, 0.25], "intensity": 4},
    {"type": "point", "range": 7}, {"type": "spot", "spot": {"innerConeAngle": 0.125, "outerConeAngle": 0.5}}]}},
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 1}, {"attributes": {"POSITION": 0}},
    {"attributes": {"POSITION": 0}, "material": 2}]}],
"accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}],
"materials": [{"name": "plain"}, {"name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
    "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.75], "baseColorTexture": {"index": 0, "texCoord": 3,
        "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": 1, "scale": [2, 4]}}}}},
    {"name": "fern", "alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}],
"samplers": [{"wrapS": 33071, "wrapT": 33648}], "textures": [{"source": 0, "sampler": 0}, {"source": 1}],
"images": [{"uri": "data:image/png;base64,SU1BR0U="}, {"uri": "x.png"}]})");
    return path;
}

void assert_same_materials(const vsh_model *here, const vsh_model *there) {
    assert_int_equal(here->material_count, there->material_count);
    for (size_t i = 0; i < here->material_count; ++i) {
        const vshi_material a = vshi_model_get_material(here, i), b = vshi_model_get_material(there, i);
        assert_string_equal(a.name, b.name);
        assert_true(a.alpha == b.alpha && a.double_sided == b.double_sided && a.uv_set == b.uv_set);
        assert_true(a.alpha_cutoff == b.alpha_cutoff && a.base_alpha == b.base_alpha);
        assert_true(a.image_channel == b.image_channel && a.by_texture == b.by_texture);
        assert_memory_equal(a.wrap, b.wrap, sizeof a.wrap);
        assert_memory_equal(a.uv_transform, b.uv_transform, sizeof a.uv_transform);
        assert_int_equal(a.image_size, b.image_size);
        assert_memory_equal(a.image, b.image, a.image_size);
        assert_int_equal(a.image_path != nullptr, b.image_path != nullptr);
        assert_string_equal(a.image_path ? a.image_path : "", b.image_path ? b.image_path : "");
    }
}

void assert_same_lights(const vsh_model *here, const vsh_model *there) {
    assert_int_equal(here->light_count, there->light_count);
    for (size_t i = 0; i < here->light_count; ++i) {
        const vshi_model_light a = here->lights[i], b = there->lights[i];
        assert_string_equal(a.name, b.name);
        assert_int_equal(a.type, b.type);
        assert_memory_equal(a.position, b.position, sizeof a - offsetof(vshi_model_light, position));
    }
}

// Both arrays are there, or neither is.
template <typename Value> void assert_same_array(const Value *a, const Value *b, size_t count) {
    assert_int_equal(a != nullptr, b != nullptr);
    if (a != nullptr) {
        assert_memory_equal(a, b, count * sizeof *a);
    }
}

TEST(models_are_the_same) {
    for (const std::string &path : {ASSETS + "/cloister.glb", ASSETS + "/cloister.obj", ASSETS + "/thin.glb",
                                    ASSETS + "/seeds_floor.obj", materials_file()}) {
        const Both<vsh_model> read(vsh_model_free, [&](const vsh_run *run, vsh_model **model) {
            return vsh_model_read(path.c_str(), run, model, &failure);
        });
        assert_same_materials(read.here, read.there);
        assert_same_lights(read.here, read.there);
        const size_t count = vsh_model_mesh_count(read.here);
        assert_int_equal(vsh_model_mesh_count(read.there), count);
        for (size_t i = 0; i < count; ++i) {
            assert_int_equal(read.there->shapes[read.there->entries[i].shape].material,
                             read.here->shapes[read.here->entries[i].shape].material);
            assert_int_equal(vsh_model_uv_sets(read.there, i), vsh_model_uv_sets(read.here, i));
            for (int32_t set = -1; set < vsh_model_uv_sets(read.here, i); ++set) {
                const vsh_mesh a = vsh_model_mesh(read.here, i, set), b = vsh_model_mesh(read.there, i, set);
                assert_int_equal(a.vertex_count, b.vertex_count);
                assert_int_equal(a.triangle_count, b.triangle_count);
                assert_string_equal(a.name, b.name);
                assert_same_array(a.positions, b.positions, 3 * a.vertex_count);
                assert_same_array(a.indices, b.indices, 3 * a.triangle_count);
                assert_same_array(a.transform, b.transform, 12);
                assert_same_array(a.normals, b.normals, 3 * a.vertex_count);
                assert_same_array(a.uvs, b.uvs, 2 * a.vertex_count);
            }
        }
    }
}

TEST(images_are_the_same) {
    const std::string png = ASSETS + "/terrain.png", exr = in_folder("image.exr"),
                      tif = in_folder("image.tif");
    for (const std::string &path : {png, exr, tif}) {
        const Both<vsh_image_file> read(vsh_image_free, [&](const vsh_run *run, vsh_image_file **file) {
            return vsh_image_read(path.c_str(), run, file, &failure);
        });
        const vsh_image a = vsh_image_view(read.here), b = vsh_image_view(read.there);
        size_t attributes[2];
        const vsh_attribute *left = vsh_image_attributes(read.here, &attributes[0]);
        const vsh_attribute *right = vsh_image_attributes(read.there, &attributes[1]);
        assert_int_equal(attributes[0], attributes[1]);
        for (size_t i = 0; i < attributes[0]; ++i) {
            assert_string_equal(left[i].name, right[i].name);
            assert_string_equal(left[i].value, right[i].value);
        }
        assert_true(a.width == b.width && a.height == b.height && a.channel_count == b.channel_count);
        for (int32_t c = 0; c < a.channel_count; ++c) {
            assert_string_equal(a.names[c], b.names[c]);
            assert_same_array(a.planes[c], b.planes[c], size_t(a.width) * size_t(a.height));
        }
        for (const std::string &copy : {exr, tif}) { // which are read next
            if (path == png) {
                assert_int_equal(vsh_image_write(copy.c_str(), &a, nullptr, &failure), VSH_OK);
            }
        }
    }
}

TEST(lists_voxels_and_texts_are_the_same) {
    const std::string path = ball_file();
    vsh_vdb_entry entries[2][2] = {};
    size_t counts[2];
    for (int i = 0; i < 2; ++i) {
        const vsh_run run = with_reader(i == 1);
        assert_int_equal(vsh_vdb_list(path.c_str(), &run, entries[i], 2, &counts[i], &failure), VSH_OK);
    }
    assert_int_equal(counts[0], counts[1]);
    assert_same_info(entries[0], entries[1]);

    const Both<vsh_voxels> voxels(vsh_voxels_free, [&](const vsh_run *run, vsh_voxels **made) {
        return vsh_voxels_from_vdb(path.c_str(), nullptr, run, made, &failure);
    });
    const vsh_voxels &here = *voxels.here, &there = *voxels.there;
    assert_int_equal(here.info.blocks, there.info.blocks);
    for (size_t i = 0; i < here.info.blocks; ++i) {
        assert_same_info(here.blocks[i].origin, there.blocks[i].origin);
        assert_same_info(here.blocks[i].mask, there.blocks[i].mask);
    }
    assert_same_info(here.info.bounds_min, there.info.bounds_min);
    assert_same_info(here.info.voxel_size, there.info.voxel_size);

    const Both<vsh_outline> outline(vsh_outline_free, [&](const vsh_run *run, vsh_outline **made) {
        return vshi_outline_from_text("Ag&8\nx", FONT.c_str(), nullptr, run, made, &failure);
    });
    const size_t contours = outline.here->contour_count;
    assert_int_equal(contours, outline.there->contour_count);
    assert_same_array(outline.here->points, outline.there->points, outline.here->starts[contours]);
}

TEST(errors_are_the_same) {
    const std::string text = in_folder("text.vdb"), obj = in_folder("bad.obj");
    put(text, "v 0 0 0\n");
    put(obj, "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n");
    for (const std::string &path : {in_folder("none.vdb"), text, ball_file(), obj, in_folder("none.obj")}) {
        vsh_error said[2];
        for (int i = 0; i < 2; ++i) {
            const vsh_run run = with_reader(i == 1);
            vsh_grid *grid = nullptr;
            vsh_model *model = nullptr;
            const vsh_result result = path.find(".vdb") != std::string::npos
                                          ? vsh_grid_read(path.c_str(), "missing", &run, &grid, &said[i])
                                          : vsh_model_read(path.c_str(), &run, &model, &said[i]);
            assert_true(result != VSH_OK && result == said[i].code && grid == nullptr && model == nullptr);
        }
        assert_int_equal(said[0].code, said[1].code);
        assert_string_equal(said[0].message, said[1].message);
    }
}

// --- readers that fail

size_t open_files() {
    size_t count = 0;
    DIR *files = opendir("/proc/self/fd");
    while (files != nullptr && readdir(files) != nullptr) {
        ++count;
    }
    closedir(files);
    return count;
}

void assert_no_child() {
    assert_int_equal(waitpid(-1, nullptr, WNOHANG), -1);
    assert_int_equal(errno, ECHILD);
}

TEST(a_reader_that_fails_is_an_error_with_its_reason) {
    const struct {
        const char *how;
        double seconds;
        vsh_result expected;
        const char *reason;
    } cases[] = {
        {"crash", 120.0, VSH_ERROR_READ, "ball.vdb: damaged: the reader crashed (SIGSEGV)"},
        {"hang", 0.3, VSH_ERROR_LIMIT, "ball.vdb: reading it takes longer than the limit of 0.3 s"},
        {"close", 0.3, VSH_ERROR_LIMIT, "ball.vdb: reading it takes longer than the limit of 0.3 s"},
        {"spin", 60.0, VSH_ERROR_LIMIT, "ball.vdb: reading it takes longer than the limit"},
        {"hungry", 120.0, VSH_ERROR_LIMIT, "more than the memory limit of 100 MB"},
        {"silent", 120.0, VSH_ERROR_ARGUMENT, "'/proc/self/exe' is no reader of vdbshade"},
        {"ends", 120.0, VSH_ERROR_ARGUMENT, "is no reader"},
        {"long", 120.0, VSH_ERROR_READ, "ball.vdb: damaged: its reader sent a bad answer"},
        {"code", 120.0, VSH_ERROR_READ, "an unknown result"},
    };
    const std::string path = ball_file();
    const size_t files = open_files();
    for (const auto &one : cases) {
        if (VSHI_SANITIZED && std::string(one.how) == "hungry") {
            continue; // nothing limits its memory
        }
        misbehave(one.how);
        vsh_run run = with_reader();
        run.reader_seconds = one.seconds;
        run.memory_limit = 100000000;
        vsh_grid *grid = nullptr;
        assert_said(vsh_grid_read(path.c_str(), nullptr, &run, &grid, &failure), one.expected, {one.reason});
        assert_null(grid);
        vsh_model *model = nullptr;
        assert_int_equal(vsh_model_read((ASSETS + "/thin.glb").c_str(), &run, &model, &failure),
                         one.expected);
        assert_no_child();
        assert_int_equal(open_files(), files);
    }
    misbehave(nullptr);
}

TEST(a_program_that_names_itself_and_does_not_serve_starts_once) {
    const std::string path = ball_file(), starts = in_folder("starts.txt");
    put(starts, "");
    setenv(STARTS, starts.c_str(), 1);
    setenv(READS, path.c_str(), 1);
    misbehave("host");
    const vsh_run run = with_reader();
    vsh_grid *grid = nullptr;
    assert_said(vsh_grid_read(path.c_str(), nullptr, &run, &grid, &failure), VSH_ERROR_ARGUMENT,
                {"ball.vdb: '/proc/self/exe' is no reader of vdbshade", "does not call vsh_reader_serve()"});
    misbehave(nullptr);
    assert_string_equal(content(starts).c_str(),
                        ("started\n" + path +
                         ": not read: this process is a reader itself; main has to call vsh_reader_serve() "
                         "before anything else\n")
                            .c_str());
    assert_no_child();
}

TEST(a_program_that_is_missing_or_no_reader_is_an_argument) {
    const std::string path = ball_file();
    vsh_run run = with_reader();
    vsh_grid *grid = nullptr;
    for (const char *program : {"/nowhere/reader", "/bin/true", "/tmp"}) {
        run.reader = program;
        assert_said(vsh_grid_read(path.c_str(), nullptr, &run, &grid, &failure), VSH_ERROR_ARGUMENT,
                    {program, "ball.vdb"});
        assert_no_child();
    }
    run = with_reader();
    run.reader_seconds = -1.0;
    assert_int_equal(vsh_grid_read(path.c_str(), nullptr, &run, &grid, &failure), VSH_ERROR_ARGUMENT);
}

TEST(cancelling_kills_the_reader) {
    misbehave("hang");
    const std::string path = ball_file();
    static int calls;
    vsh_run run = with_reader();
    run.progress = [](void *, const char *, double) { return int32_t(--calls <= 0); };
    for (const int after : {1, 2, 5}) {
        vsh_grid *grid = nullptr;
        vsh_model *model = nullptr;
        vsh_image_file *image = nullptr;
        calls = after;
        assert_int_equal(vsh_grid_read(path.c_str(), nullptr, &run, &grid, &failure), VSH_ERROR_CANCELLED);
        calls = after;
        assert_int_equal(vsh_model_read((ASSETS + "/thin.glb").c_str(), &run, &model, &failure),
                         VSH_ERROR_CANCELLED);
        calls = after;
        assert_int_equal(vsh_image_read((ASSETS + "/terrain.png").c_str(), &run, &image, &failure),
                         VSH_ERROR_CANCELLED);
        assert_no_child();
    }
    misbehave(nullptr);
}

TEST(a_host_may_ignore_its_children_and_have_threads) {
    const std::string path = ball_file();
    const vsh_run run = with_reader();
    void (*const before)(int) = signal(SIGCHLD, SIG_IGN);
    std::vector<std::thread> threads;
    std::atomic<int> good{0};
    for (int i = 0; i < 4; ++i) {
        threads.emplace_back([&] {
            OWNED(vsh_grid) *grid = nullptr;
            vsh_error error;
            good += vsh_grid_read(path.c_str(), nullptr, &run, &grid, &error) == VSH_OK;
        });
    }
    for (std::thread &thread : threads) {
        thread.join();
    }
    signal(SIGCHLD, before);
    assert_int_equal(good.load(), 4);
}

TEST(an_older_program_reads_in_its_own_process) {
    misbehave("crash");
    vsh_run run = with_reader();
    run.struct_size = offsetof(vsh_run, reader); // members that an older caller does not know are not read
    run.reader_seconds = -1.0;
    vsh_grid *grid = nullptr;
    assert_int_equal(vsh_grid_read(ball_file().c_str(), nullptr, &run, &grid, &failure), VSH_OK);
    vsh_grid_free(grid);
    misbehave(nullptr);
}

TEST(sizes_in_a_file_do_not_pass_the_memory_limit) {
    const std::string path = save("large.vdb", {ball<FloatGrid>(5.0, 3.0f)});
    std::string bytes = content(path);
    const size_t at = bytes.find("file_mem_bytes");
    assert_true(at != std::string::npos);
    const size_t value = bytes.find("int64", at) + 5 + 4; // type's name, size, value
    std::memset(&bytes[value], 0, 8);
    put(path, bytes);
    for (const uint64_t limit : {uint64_t(4) << 20, uint64_t(1) << 10}) {
        for (int i = 0; i < 2; ++i) {
            vsh_run run = with_reader(i == 1);
            run.memory_limit = limit;
            vsh_grid *grid = nullptr;
            assert_said(vsh_grid_read(path.c_str(), nullptr, &run, &grid, &failure), VSH_ERROR_LIMIT,
                        {"large.vdb"});
        }
    }
}

// Leaves far from each other need nodes of 300 kB each, although the file hardly stores them.
TEST(readers_keep_the_memory_limit) {
    if (VSHI_SANITIZED) { // sanitized readers have no limit
        skip();
    }
    const uint64_t limit = uint64_t(20) << 20;
    // Page faults of the reader, because its resident size includes its parent's. Allowed are the limit,
    // 64 MiB more, and 64 MiB for its libraries.
    const long MOST_FAULTS = long((limit + (uint64_t(64 + 64) << 20)) / 4096);
    const FloatGrid::Ptr far = FloatGrid::create(0.3f);
    far->setGridClass(openvdb::GRID_LEVEL_SET);
    for (int i = 0; i < 1000; ++i) {
        far->tree().setValue(openvdb::Coord(i * 40960, 0, 0), 0.1f);
    }
    const std::string path = save("far.vdb", {far});
    openvdb::io::File file(path);
    file.setGridStatsMetadataEnabled(false); // else the file says itself what it takes
    file.write({far});
    file.close();
    const pid_t host = fork(); // the reader is its only child
    assert_true(host >= 0);
    if (host == 0) {
        vsh_run run = with_reader();
        run.memory_limit = uint64_t(1) << 30; // the caller holds most of it
        run.memory_held = run.memory_limit - limit;
        std::vector<vsh_vdb_entry> entries(4);
        size_t count = 0;
        const vsh_result result =
            vsh_vdb_list(path.c_str(), &run, entries.data(), entries.size(), &count, &failure);
        struct rusage reader {};
        getrusage(RUSAGE_CHILDREN, &reader);
        _exit(result != VSH_ERROR_LIMIT ? 1 : reader.ru_minflt > MOST_FAULTS ? 2 : 0);
    }
    int status = -1;
    assert_int_equal(waitpid(host, &status, 0), host);
    assert_int_equal(status, 0);
}

// --- checks of a reader's answer

constexpr int DAMAGES = 4000;

// Runs body(), which throws a Failure for what it refuses.
template <typename Body> bool refuses(Body &&body) {
    const vsh_result result = vshi::guard(&failure, VSH_ERROR_INTERNAL, "answer", [&] {
        body();
        return VSH_OK;
    });
    assert_int_not_equal(result, VSH_ERROR_INTERNAL);
    return result != VSH_OK;
}

void no_name(vshi_encoder *encoder) {
    vshi_encode_text(encoder, nullptr);
}

void no_request(vshi_encoder *) {}

TEST(damaged_level_sets_are_refused_or_are_trees) {
    const auto whole = payload_of(vshi_serve_grid, ball_file(), no_name);
    const int refused = damage(whole, DAMAGES, [&](vshi_decoder *decoder) {
        return refuses([&] {
            const vshi::LevelSet set = vshi::decode_level_set(decoder, "a.vdb");
            const vsh_run run = vsh_run_default();
            vshi::Stage stage(run, "load");
            if (vshi::examine_matrix(set.matrix).kind != vshi::Finding::BAD) {
                vshi::examine_values(*set.grid, vshi::axis_of(set.matrix.data(), 0).length(), stage);
            }
        });
    });
    assert_in_range(refused, DAMAGES / 8, DAMAGES - 1);
}

TEST(damaged_voxels_are_refused_or_sorted) {
    const auto whole = payload_of(vshi_serve_voxels, ball_file(), no_name);
    const int refused = damage(whole, DAMAGES, [&](vshi_decoder *decoder) {
        return refuses([&] {
            std::string grid;
            vshi::Matrix matrix;
            const auto blocks = vshi::decode_blocks(decoder, "a.vdb", grid, matrix);
            assert_true(std::is_sorted(blocks.begin(), blocks.end(), [](const auto &a, const auto &b) {
                return std::lexicographical_compare(a.origin, a.origin + 3, b.origin, b.origin + 3);
            }));
        });
    });
    assert_in_range(refused, DAMAGES / 8, DAMAGES - 1);
}

void assert_sound(const vsh_model *model) {
    for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
        const vsh_mesh mesh = vsh_model_mesh(model, i, -1);
        vsh_mesh_report report;
        const vsh_result result = vsh_mesh_check(&mesh, &report, &failure);
        assert_true(result == VSH_OK || result == VSH_ERROR_INPUT); // beyond numbers once moved
        assert_true(model->shapes[model->entries[i].shape].material <= int32_t(model->material_count));
    }
    for (size_t i = 0; i < model->material_count; ++i) {
        const vshi_material m = vshi_model_get_material(model, i);
        assert_in_range(m.uv_set, 0, VSH_MAX_UV_SETS - 1);
        assert_in_range(m.wrap[0], 0, VSH_WRAP_CLAMP);
        assert_in_range(m.alpha, 0, VSH_ALPHA_BLENDED);
        assert_true(m.base_alpha >= 0.0 && m.base_alpha <= 1.0 && std::isfinite(m.uv_transform[5]));
        assert_in_range(m.image != nullptr ? m.image_size : 0, 0, 16);
    }
    for (size_t i = 0; i < model->light_count; ++i) {
        const vshi_model_light light = model->lights[i];
        assert_in_range(light.type, 0, VSHI_MODEL_LIGHT_SPOT);
        assert_true(light.inner_angle <= light.outer_angle && light.outer_angle <= 1.5708);
        assert_true(light.intensity >= 0.0 && std::isfinite(light.intensity) && light.range >= 0.0);
    }
}

TEST(damaged_models_are_refused_or_sound) {
    for (const std::string &path : {ASSETS + "/thin.glb", materials_file()}) {
        const auto whole = payload_of(vshi_serve_model, path, no_request);
        const int refused = damage(whole, DAMAGES, [&](vshi_decoder *decoder) {
            OWNED(vsh_model) *model = nullptr;
            if (vshi_model_decode(decoder, path.c_str(), nullptr, &model, &failure) != VSH_OK) {
                return true;
            }
            assert_sound(model);
            return false;
        });
        assert_in_range(refused, DAMAGES / 8, DAMAGES - 1);
    }
}

TEST(a_path_from_a_reader_that_leaves_the_folder_is_refused) {
    const std::string path = materials_file(), image = in_folder("x.png"), outside = "/etc/passwd";
    auto bytes = payload_of(vshi_serve_model, path, no_request);
    const auto at = std::search(bytes.begin(), bytes.end(), image.begin(), image.end());
    assert_true(at != bytes.end());
    std::fill_n(at, image.size(), '/'); // whose length stays
    std::copy(outside.begin(), outside.end(), at + long(image.size() - outside.size()));
    vshi_decoder decoder = {bytes.data(), bytes.data() + bytes.size(), false};
    vsh_model *model = nullptr;
    assert_fails(vshi_model_decode(&decoder, path.c_str(), nullptr, &model, &failure), VSH_ERROR_READ,
                 "its images");
}

TEST(damaged_decompressed_vertices_are_refused_or_sound) {
    constexpr size_t PRIMITIVES = 3;
    const auto whole = payload_of(vshi_serve_draco, std::string(VSH_MODELS) + "/scene_draco.glb", no_request);
    const int refused = damage(whole, DAMAGES, [&](vshi_decoder *decoder) {
        FREED_BY(vshi_lit_dracos_free) vshi_lit_dracos dracos = {};
        dracos.list = static_cast<vshi_lit_draco *>(std::calloc(PRIMITIVES, sizeof *dracos.list));
        dracos.count = PRIMITIVES;
        const bool bad = vshi_lit_dracos_decode(decoder, "a.glb", &dracos, &failure) != VSH_OK;
        for (size_t i = 0; i < PRIMITIVES; ++i) { // each index is one of a vertex, each value is there
            const vshi_lit_draco &draco = dracos.list[i];
            unsigned sum = 0;
            for (size_t k = 0; draco.attribute_count > 0 && k < 3 * draco.triangle_count; ++k) {
                assert_true(draco.indices[k] < draco.vertex_count);
            }
            for (size_t k = 0; k < draco.attribute_count && draco.vertex_count > 0; ++k) {
                const vshi_lit_draco_attribute &attribute = draco.attributes[k];
                const size_t size = draco.vertex_count * size_t(attribute.components) *
                                    vshi_gltf_component_size(attribute.type);
                sum += attribute.values != nullptr ? attribute.values[size - 1] : 0;
            }
            assert_true(sum < 1000000);
        }
        return bad;
    });
    assert_in_range(refused, DAMAGES / 64, DAMAGES - 1);
}

TEST(damaged_images_and_contours_are_refused_or_sound) {
    auto whole = payload_of(vshi_serve_image, ASSETS + "/emblem.png",
                            [](vshi_encoder *request) { vshi_encode_count(request, 0); }); // bytes of its own
    int refused = damage(whole, DAMAGES / 8, [&](vshi_decoder *decoder) {
        OWNED(vsh_image_file) *file = nullptr;
        const bool bad = vshi_image_decode(decoder, "a.png", &file, &failure) != VSH_OK;
        const vsh_image image = vsh_image_view(file);
        for (int32_t c = 0; c < image.channel_count; ++c) {
            assert_in_range(std::strlen(image.names[c]), 0, 255);
        }
        return bad;
    });
    assert_in_range(refused, DAMAGES / 64, DAMAGES / 8 - 1);
    whole = payload_of(vshi_serve_text, FONT, [](vshi_encoder *encoder) {
        vshi_encode_text(encoder, "A8");
        vshi_encode_number(encoder, 1.0);
        vshi_encode_number(encoder, 1.0);
        vshi_encode_count(encoder, 0);
    });
    refused = damage(whole, DAMAGES, [&](vshi_decoder *decoder) {
        const vsh_run run = vsh_run_default();
        vshi_contours contours = {};
        contours.run = &run;
        contours.error = &failure;
        OWNED(vsh_outline) *outline = nullptr;
        if (vshi_contours_decode(decoder, &contours, "a.ttf", &failure) != VSH_OK) {
            vshi_contours_free(&contours);
            return true;
        }
        return vshi_contours_finish(&contours, false, "text", &outline) != VSH_OK;
    });
    assert_in_range(refused, DAMAGES / 8, DAMAGES - 1);
}

TEST(a_message_is_not_read_past_its_end) {
    alignas(8) const uint64_t words[] = {16, 0x4242424242424242, 0x0042424242424242, UINT64_MAX, 5, 0};
    const auto decoder_of = [&](size_t from, size_t to) {
        const auto *bytes = reinterpret_cast<const unsigned char *>(words);
        return vshi_decoder{bytes + 8 * from, bytes + 8 * to, false};
    };
    vshi_decoder decoder = decoder_of(0, 3);
    assert_string_equal(vshi_decode_text(&decoder, true), "BBBBBBBBBBBBBBB");
    assert_true(vshi_decoder_ends(&decoder));
    for (const size_t from : {0, 1}) { // the text ends behind the message; a size out of the world
        decoder = decoder_of(from, from + 2);
        assert_null(vshi_decode_text(&decoder, true));
        assert_true(decoder.bad);
    }
    decoder = decoder_of(3, 5);
    assert_null(vshi_decode_text(&decoder, true)); // a NULL that was sent
    assert_false(decoder.bad);
    assert_null(vshi_decode_array(&decoder, uint64_t(1) << 62, 8)); // a product out of range
    assert_true(decoder.bad);
    decoder = decoder_of(4, 6);
    assert_int_equal(vshi_decode_count(&decoder, 4), 0);
    assert_true(decoder.bad);
}

// An answer is memory, too: it fails if it does not fit beside the heap, even if each alone would fit.
TEST(an_answer_and_the_heap_share_their_room) {
    if (VSHI_SANITIZED) {
        skip(); // its heap is not libc's, which tells what it holds
    }
    static vshi_encoder encoder;
    const size_t bytes = size_t(8) << 20;
    const std::vector<char> answer(bytes);
    for (const bool heap : {false, true}) {
        const struct mallinfo2 now = mallinfo2();
        const std::vector<char> held(heap ? bytes : 0);
        const int file = memfd_create("answer", 0);
        vshi_encoder_begin(&encoder, file, 0);
        encoder.room = now.uordblks + now.hblkhd + bytes + bytes / 2;
        vshi_encode_array(&encoder, answer.data(), bytes, 1);
        assert_true(vshi_encoder_flush(&encoder) == !heap);
        assert_int_equal(encoder.error, heap ? ENOMEM : 0);
        close(file);
    }
}

} // namespace

int main(int argc, char **argv) {
    return run_all_tests_or_read(argc, argv);
}
