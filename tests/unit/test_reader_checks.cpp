// What a reader may send, and do: no answer, however damaged, harms the caller, and a confined process is
// one.
#include "readers.h"

extern "C" {
#include "lit/work.h"
}

#include <fcntl.h>
#include <malloc.h>
#include <sys/ptrace.h>
#include <sys/socket.h>

#include "testing.h"

namespace {

constexpr int DAMAGES = 4000;

// Runs body(); what it throws as a Failure is counted.
template <typename Body> void counted(int &refused, Body &&body) {
    const vsh_result result = vshi::guard(&failure, VSH_ERROR_INTERNAL, "answer", body);
    assert_int_not_equal(result, VSH_ERROR_INTERNAL);
    refused += result != VSH_OK;
}

TEST(damaged_level_sets_are_refused_or_are_trees) {
    const std::string path = save("ball.vdb", {sphere()});
    const std::vector<unsigned char> whole =
        payload_of(vshi_serve_grid, path, [](vshi_encoder *encoder) { vshi_encode_text(encoder, nullptr); });
    int refused = 0;
    damage(whole, DAMAGES, [&](vshi_decoder *decoder) {
        counted(refused, [&]() -> vsh_result {
            const vshi::LevelSet set = vshi::take_level_set(decoder, "a.vdb", &failure);
            const vsh_run run = vsh_run_default();
            vshi::Stage stage(run, "load", &failure);
            const vshi::Finding kind = vshi::examine_kind(*set.grid);
            if (kind.kind != vshi::Finding::BAD) {
                vshi::examine_values(*set.grid, stage);
            }
            return VSH_OK;
        });
    });
    assert_in_range(refused, DAMAGES / 8, DAMAGES - 1);
}

TEST(damaged_voxels_are_refused_or_sorted) {
    const std::string path = save("ball.vdb", {sphere()});
    const std::vector<unsigned char> whole = payload_of(
        vshi_serve_voxels, path, [](vshi_encoder *encoder) { vshi_encode_text(encoder, nullptr); });
    int refused = 0;
    damage(whole, DAMAGES, [&](vshi_decoder *decoder) {
        counted(refused, [&]() -> vsh_result {
            std::string grid;
            openvdb::math::Transform::Ptr transform;
            const auto blocks = vshi::take_blocks(decoder, "a.vdb", grid, transform, &failure);
            for (size_t i = 1; i < blocks.size(); ++i) {
                assert_true(std::lexicographical_compare(blocks[i - 1].origin, blocks[i - 1].origin + 3,
                                                         blocks[i].origin, blocks[i].origin + 3));
            }
            return VSH_OK;
        });
    });
    assert_in_range(refused, DAMAGES / 8, DAMAGES - 1);
}

TEST(damaged_models_are_refused_or_sound) {
    const std::vector<unsigned char> whole =
        payload_of(vshi_serve_model, std::string(VSH_ASSETS) + "/thin.glb", [](vshi_encoder *) {});
    int refused = 0;
    damage(whole, DAMAGES, [&](vshi_decoder *decoder) {
        OWNED(vsh_model) *model = nullptr;
        if (vshi_model_decode(decoder, "a.glb", nullptr, &model, &failure) != VSH_OK) {
            ++refused;
            return;
        }
        for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
            const vsh_mesh mesh = vsh_model_mesh(model, i, -1);
            vsh_mesh_report report;
            const vsh_result result = vsh_mesh_check(&mesh, &report, &failure);
            assert_true(result == VSH_OK || result == VSH_ERROR_INPUT); // beyond numbers once moved
        }
    });
    assert_in_range(refused, DAMAGES / 8, DAMAGES - 1);
}

TEST(damaged_decompressed_vertices_are_refused_or_sound) {
    constexpr size_t PRIMITIVES = 3;
    const std::vector<unsigned char> whole =
        payload_of(vshi_serve_draco, std::string(VSH_MODELS) + "/scene_draco.glb", [](vshi_encoder *) {});
    int refused = 0;
    damage(whole, DAMAGES, [&](vshi_decoder *decoder) {
        FREED_BY(vshi_lit_dracos_free) vshi_lit_dracos dracos = {};
        dracos.list = static_cast<vshi_lit_draco *>(std::calloc(PRIMITIVES, sizeof *dracos.list));
        dracos.count = PRIMITIVES;
        refused += vshi_lit_dracos_decode(decoder, "a.glb", &dracos, &failure) != VSH_OK;
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
    });
    assert_in_range(refused, DAMAGES / 64, DAMAGES - 1);
}

TEST(damaged_images_and_contours_are_refused_or_sound) {
    const char *font = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
    std::vector<unsigned char> whole =
        payload_of(vshi_serve_image, std::string(VSH_ASSETS) + "/emblem.png", [](vshi_encoder *request) {
            vshi_encode_count(request, 0); /* bytes of its own */
        });
    int refused = 0;
    damage(whole, DAMAGES / 8, [&](vshi_decoder *decoder) {
        vsh_image_file *file = nullptr;
        refused += vshi_image_decode(decoder, "a.png", &file, &failure) != VSH_OK;
        const vsh_image image = vsh_image_view(file);
        for (int32_t c = 0; c < image.channel_count; ++c) {
            assert_in_range(std::strlen(image.names[c]), 0, 255);
        }
        vsh_image_free(file);
    });
    assert_in_range(refused, DAMAGES / 64, DAMAGES / 8 - 1);
    whole = payload_of(vshi_serve_text, font, [](vshi_encoder *encoder) {
        vshi_encode_text(encoder, "A8");
        vshi_encode_number(encoder, 1.0);
        vshi_encode_number(encoder, 1.0);
        vshi_encode_count(encoder, 0);
    });
    refused = 0;
    damage(whole, DAMAGES, [&](vshi_decoder *decoder) {
        const vsh_run run = vsh_run_default();
        vshi_contours contours = {};
        contours.run = &run;
        contours.error = &failure;
        OWNED(vsh_outline) *outline = nullptr;
        if (vshi_contours_decode(decoder, &contours, "a.ttf", &failure) != VSH_OK) {
            vshi_contours_free(&contours);
            ++refused;
        } else if (vshi_contours_finish(&contours, false, "text", &outline) != VSH_OK) {
            ++refused;
        }
    });
    assert_in_range(refused, DAMAGES / 8, DAMAGES - 1);
}

TEST(a_message_is_not_read_past_its_end) {
    alignas(8) const uint64_t words[] = {16, 0x4242424242424242, 0x0042424242424242, UINT64_MAX, 5, 0};
    const auto *bytes = reinterpret_cast<const unsigned char *>(words);
    vshi_decoder decoder = {bytes, bytes + 24, false};
    assert_string_equal(vshi_decode_text(&decoder, true), "BBBBBBBBBBBBBBB");
    assert_true(vshi_decoder_ends(&decoder));
    decoder = {bytes, bytes + 16, false}; // the text ends behind it
    assert_null(vshi_decode_text(&decoder, true));
    assert_true(decoder.bad);
    decoder = {bytes + 8, bytes + 24, false}; // a size out of the world
    assert_null(vshi_decode_text(&decoder, true));
    assert_true(decoder.bad);
    decoder = {bytes + 24, bytes + 40, false};
    assert_null(vshi_decode_text(&decoder, true)); // NULL that was put
    assert_false(decoder.bad);
    assert_null(vshi_decode_array(&decoder, uint64_t(1) << 62, 8)); // a product out of range
    assert_true(decoder.bad);
    decoder = {bytes + 32, bytes + 48, false};
    assert_int_equal(vshi_decode_count(&decoder, 4), 0);
    assert_true(decoder.bad);
}

// An answer is memory, too: it ends where the heap leaves it no room, whatever each may come to alone.
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

// What a confined process has tried and was let do, as bits of its exit code.
int forbidden_things() {
    int done = 0;
    vshi_confine_resources(uint64_t(1) << 30, uint64_t(64) << 20, 60.0);
    if (!vshi_confine_calls()) {
        return 128;
    }
    const std::string mine = in_folder("mine"), there = in_folder("ball.vdb");
    char *const arguments[] = {nullptr};
    done |= socket(AF_INET, SOCK_STREAM, 0) >= 0 || socket(AF_UNIX, SOCK_STREAM, 0) >= 0 ? 1 : 0;
    done |= open(mine.c_str(), O_CREAT | O_WRONLY, 0600) >= 0 || open(there.c_str(), O_RDWR) >= 0 ? 2 : 0;
    done |= kill(getppid(), 0) == 0 ? 4 : 0;
    done |= ptrace(PTRACE_ATTACH, getppid(), nullptr, nullptr) == 0 ? 8 : 0;
    done |= unlink(there.c_str()) == 0 ? 16 : 0;
    const pid_t child = fork();
    if (child == 0) {
        _exit(0);
    }
    done |= child > 0 ? 32 : 0;
    execve("/bin/true", arguments, arguments); // its exit code would be 0
    done |= open(there.c_str(), O_RDONLY) < 0 ? 64 : 0;
    void *memory =
        mmap(nullptr, size_t(8) << 30, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    return memory != MAP_FAILED ? 127 : 200 + done;
}

TEST(a_confined_process_reads_and_nothing_else) {
    if (VSHI_SANITIZED) {
        skip();
    }
    save("ball.vdb", {sphere()});
    const pid_t child = fork();
    if (child == 0) {
        _exit(forbidden_things());
    }
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    if (WEXITSTATUS(status) == 128) {
        print_message("this host allows no filter of system calls\n");
        skip();
    }
    assert_int_equal(WEXITSTATUS(status), 200);
}

} // namespace

int main(int argc, char **argv) {
    const int served = as_reader(argc, argv);
    if (served >= 0) {
        _exit(served);
    }
    return make_folder() ? run_all_tests(nullptr, remove_folder) : 1;
}
