// Hosts with their own settings: rounding, flush to zero, a locale with a decimal comma, arenas and threads.
// Every call gives the same bits as in a plain program, and restores the host's settings.
#include <clocale>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "base/bytes.h"
#include "base/floats.h"
#include "base/tbb.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "folder.h"

// A host that exports its own Embree (tests/CMakeLists.txt).
extern "C" {
__attribute__((visibility("default"))) void *rtcNewDevice(const char *config);
}
static bool host_called;
void *rtcNewDevice(const char *) {
    host_called = true;
    return nullptr;
}

namespace {

OWNER(vsh_provenance)

// Keeps the text of a failure, as cmocka cannot report one of another thread.
struct Outcome {
    uint64_t hash = 0;
    std::string failure;

    bool check(vsh_result result, const vsh_error &error) {
        if (result != VSH_OK && failure.empty()) {
            failure = error.message;
        }
        return result == VSH_OK;
    }
    template <typename Value> void add(const Value *values, size_t count) {
        const auto *bytes = reinterpret_cast<const unsigned char *>(values);
        for (size_t i = 0; i < count * sizeof(Value); ++i) {
            hash = vshi_mix(hash + bytes[i] + 0x9e3779b97f4a7c15u);
        }
    }
};

vsh_result add_rows(void *user, const vsh_scene_lightmap *, const vsh_image *image, int32_t, int32_t rows,
                    const float *const *planes, vsh_error *) {
    for (int32_t c = 0; c < image->channel_count; ++c) {
        static_cast<Outcome *>(user)->add(planes[c], size_t(image->width) * size_t(rows));
    }
    return VSH_OK;
}

// Everything that reads numbers, computes with them or writes them.
Outcome work(int32_t threads = 0) {
    Outcome o;
    vsh_run run = run_on(threads);
    OWNED(vsh_scene) *scene = nullptr;
    OWNED(vsh_assets) *assets = nullptr;
    OWNED(vsh_grid) *grid = nullptr;
    OWNED(vsh_occluders) *occluders = nullptr;
    OWNED(vsh_provenance) *provenance = nullptr;
    vsh_error error{};
    if (o.check(vsh_scene_read(at("scene.json"), nullptr, &scene, &error), error) &&
        o.check(vsh_assets_load(scene, &run, &assets, &error), error) &&
        o.check(vsh_scene_casters(scene, assets, &run, &grid, &error), error) &&
        o.check(vsh_occluders_from_grid(grid, nullptr, &run, &occluders, &error), error)) {
        constexpr size_t COUNT = 400;
        std::vector<double> positions;
        std::vector<float> normals, values(COUNT);
        for (size_t i = 0; i < COUNT; ++i) {
            positions.insert(positions.end(),
                             {-1.4 + 0.15 * double(i % 20), 0.01, -1.4 + 0.15 * double(i / 20)});
            normals.insert(normals.end(), {0.0f, 1.0f, 0.0f});
        }
        const vsh_points points = {COUNT, positions.data(), normals.data(), nullptr};
        vsh_shade_options options = scene->shade;
        options.rays = 16;
        for (const vsh_shadow_method method : {VSH_SHADOW_CONE, VSH_SHADOW_ADAPTIVE}) {
            options.method = method;
            o.check(vsh_shade_shadow(occluders, &points, &scene->lights[0], &options, &run, values.data(),
                                     nullptr, nullptr, &error),
                    error);
            o.add(values.data(), COUNT);
        }
        o.check(vsh_shade_ao(occluders, &points, &options, &run, values.data(), nullptr, nullptr, nullptr,
                             &error),
                error);
        o.add(values.data(), COUNT);
        vsh_bake_options bake = vsh_bake_options_default();
        bake.user = &o;
        bake.rows = add_rows;
        vsh_bake_error errors[3]{};
        vsh_bake_report report{};
        report.errors = errors;
        o.check(vsh_bake_scene(scene, &bake, &run, &report, &error), error);
        o.add(errors, 3);
        vsh_provenance_source source = vsh_provenance_source_default();
        source.scene = scene;
        source.voxel_size = 0.0625;
        o.check(vsh_provenance_create(&source, &run, &provenance, &error), error);
        size_t count = 0;
        const vsh_attribute *list = vsh_provenance_attributes(provenance, &count);
        for (size_t i = 0; i < count; ++i) {
            o.add(list[i].value, std::strlen(list[i].value));
        }
    }
    return o;
}

void expect_same(const Outcome &plain, const Outcome &other, const char *host) {
    assert_that(other.failure.empty(), "%s: %s", host, other.failure.c_str());
    assert_that(plain.hash == other.hash, "%s: other bits", host);
}

Outcome plain() {
    const Outcome o = work(1);
    assert_that(o.failure.empty(), "%s", o.failure.c_str());
    return o;
}

// test_bits has every setting, of calls that read no file.
TEST(rounding_and_flushing_to_zero_change_nothing_and_are_given_back) {
    const Outcome expected = plain();
    const vshi_floats host = vshi_floats_get();
#if defined(__x86_64__)
    constexpr vshi_floats SETTINGS[] = {0x8040, 0x2000, 0x4000, 0x6000}; // FTZ and DAZ; down, up, to zero
#else
    constexpr vshi_floats SETTINGS[] = {1u << 24, 1u << 22, 2u << 22, 3u << 22};
#endif
    for (const vshi_floats setting : SETTINGS) {
        vshi_floats_set(host | setting);
        const Outcome there = work();
        const vshi_floats kept = vshi_floats_get();
        vshi_floats_set(host);
        assert_int_equal(kept & setting, setting);
        expect_same(expected, there, "a setting of floats");
    }
}

TEST(a_decimal_comma_changes_nothing_and_is_given_back) {
    const Outcome expected = plain();
    const std::string make =
        std::string("localedef -i de_DE -f UTF-8 ") + at("de_DE.UTF-8") + " >" + at("log") + " 2>&1";
    const int made = std::system(make.c_str());
    setenv("LOCPATH", folder, 1);
    if (std::setlocale(LC_ALL, "de_DE.UTF-8") == nullptr) {
        print_message("skipped: no locale with a comma could be made (%d)\n", made);
        unsetenv("LOCPATH");
        skip();
    }
    char text[8];
    std::snprintf(text, sizeof text, "%.1f", 0.5);
    assert_string_equal(text, "0,5"); // else this tests nothing
    const Outcome there = work();
    std::snprintf(text, sizeof text, "%.1f", 0.5);
    std::setlocale(LC_ALL, "C");
    unsetenv("LOCPATH");
    assert_string_equal(text, "0,5");
    expect_same(expected, there, "decimal comma");
}

TEST(arenas_of_the_host_change_nothing) {
    const Outcome expected = plain();
    Outcome there;
    {
        tbb::task_arena one(1);
        one.execute([&] { there = work(); });
        expect_same(expected, there, "an arena of one slot");
        tbb::task_arena many(7);
        many.execute([&] { there = work(3); });
        expect_same(expected, there, "an arena of seven");
    }
    {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        expect_same(expected, work(5), "a limit of one thread");
    }
    std::vector<Outcome> all(6);
    static const char handover = 0; // the body reads nothing before it is taken
    const auto body = [&](size_t i) {
        vshi::acquire(&handover);
        all[i] = work(int32_t(i));
        vshi::release(&handover);
    };
    vshi::release(&handover);
    tbb::parallel_for(size_t{0}, all.size(), body);
    vshi::acquire(&handover);
    for (const Outcome &o : all) {
        expect_same(expected, o, "within the host's own loop");
    }
}

// One field, one query handle, one grid: shared by threads that shade, sample and bake volumes at once.
TEST(many_threads_share_one_field) {
    const vsh_sdf_node node = vsh_sdf_node_default();
    OWNED(vsh_grid) *grid = grid_of_tree(&node, 1, with_voxel(0.0625));
    OWNED(vsh_occluders) *occluders = nullptr;
    assert_ok(vsh_occluders_from_grid(grid, nullptr, nullptr, &occluders, &failure));
    const vsh_light light = vsh_light_default();
    const auto bake = [&](int32_t threads) {
        Outcome o;
        vsh_error why{};
        vsh_run run = run_on(threads);
        OWNED(vsh_voxels) *voxels = nullptr;
        OWNED(vsh_volume) *volume = nullptr;
        o.check(vsh_voxels_from_grid(grid, 2.0, &run, &voxels, &why), why);
        o.check(vsh_bake_volume(occluders, voxels, &light, 1, nullptr, &run, &volume, nullptr, &why), why);
        std::vector<float> values(40 * 40 * 40);
        const int32_t low[3] = {-20, -20, -20}, size[3] = {40, 40, 40};
        o.check(vsh_volume_copy(volume, 0, low, size, values.data(), &why), why);
        o.add(values.data(), values.size());
        return o;
    };
    const Outcome expected = bake(1);
    assert_true(expected.failure.empty());
    std::vector<Outcome> all(12);
    std::vector<std::thread> threads;
    for (size_t i = 0; i < all.size(); ++i) {
        threads.emplace_back([&, i] { all[i] = bake(int32_t(i % 4)); });
    }
    for (std::thread &thread : threads) {
        thread.join();
    }
    for (const Outcome &o : all) {
        expect_same(expected, o, "a thread");
    }
}

TEST(embree_of_the_host_is_not_called) {
    const double low[3] = {0, 0, 0}, high[3] = {1, 1, 1};
    float corners[24];
    const vsh_mesh mesh = box_mesh(corners, low, high);
    OWNED(vsh_occluders) *occluders = nullptr;
    assert_ok(vsh_occluders_create(&mesh, 1, nullptr, nullptr, &occluders, &failure));
    assert_false(host_called);
}

int make_files(void **state) {
    if (make_folder(state) != 0) {
        return 1;
    }
    write_string(at("post.obj"), "v -0.25 0 -0.25\nv 0.25 0 -0.25\nv 0.25 0 0.25\nv -0.25 0 0.25\n"
                                 "v -0.25 1.5 -0.25\nv 0.25 1.5 -0.25\nv 0.25 1.5 0.25\nv -0.25 1.5 0.25\n"
                                 "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n");
    write_string(at("balls.csv"), "0.75, 0.5, 0.75, 0.25\n-0.75 0.5 -0.75 0.125\n");
    write_string(
        at("scene.json"),
        "{\"casters\": [{\"mesh\": \"post.obj\"}, {\"spheres\": \"balls.csv\", \"voxelised\": true},"
        " {\"sdf\": {\"shape\": \"plane\", \"half_size\": [1.5, 1.5], \"thickness\": 0.25}}],"
        " \"voxel_size\": 0.0625, \"ao\": {\"distance\": 0.75},"
        " \"lights\": [{\"name\": \"sun\", \"type\": \"directional\", \"direction\": [0.5, 0.75, 0.25],"
        " \"angle_deg\": 12.5}], \"receivers\": [{\"plane\": {\"size\": [3, 3]}, \"size\": 48, \"output\": "
        "\"o.exr\"}]}");
    return 0;
}

} // namespace

FIXTURE(make_files, remove_folder)
