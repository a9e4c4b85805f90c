// A test is its own reader (vsh_run.reader), which misbehaves on request.
#pragma once

#include "base/memory.h"
#include "io/image/image.h"
#include "io/model/model.h"
#include "io/reader/confine.h"
#include "io/reader/reader.h"
#include "levelset/file.h"
#include "shapes/outline.h"

#include "grid_files.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <string>
#include <sys/mman.h>
#include <thread>
#include <vector>

// How the next readers fail: set in the environment, which they inherit.
constexpr const char *MISBEHAVE = "VSH_TEST_READER";

inline void misbehave(const char *how) {
    if (how != nullptr) {
        setenv(MISBEHAVE, how, 1);
    } else {
        unsetenv(MISBEHAVE);
    }
}

// The file to which a program that names itself as its reader adds a line at each start: the error that it
// got.
constexpr const char *STARTS = "VSH_TEST_STARTS";
constexpr const char *READS = "VSH_TEST_READS"; // the file that it reads

inline int read_as_host() {
    const char *starts = getenv(STARTS), *path = getenv(READS);
    std::ifstream before(starts);
    const auto lines = std::count(std::istreambuf_iterator<char>(before), {}, '\n');
    constexpr int MOST = 4; // starts, so that the test ends even if the library fails
    vsh_error error = {VSH_OK, "too many starts"};
    if (lines < MOST) {
        std::ofstream(starts, std::ios::app) << "started\n";
        vsh_run run = vsh_run_default();
        run.reader = "/proc/self/exe";
        run.reader_seconds = 10.0;
        vsh_grid *grid = nullptr;
        vsh_grid_read(path, nullptr, &run, &grid, &error);
    }
    std::ofstream(starts, std::ios::app) << error.message << '\n';
    return 0;
}

inline int as_reader(int argc, char **argv) {
    const char *told = getenv(MISBEHAVE);
    const std::string how = told != nullptr ? told : "";
    if (argc < 2 || std::strcmp(argv[1], VSH_READER_ARGUMENT) != 0) {
        return -1;
    }
    if (how == "crash") {
        signal(SIGSEGV, SIG_DFL);
        raise(SIGSEGV);
    } else if (how == "hang") {
        for (;;) {
            pause();
        }
    } else if (how == "close") { // and live on
        for (int file = 3; file < 16; ++file) {
            close(file);
        }
        pause();
    } else if (how == "spin") {
        vshi_confine_resources(0, 0, 0.0);
        for (volatile uint64_t i = 0;; i = i + 1) {
        }
    } else if (how == "hungry") {
        vshi_confine_resources(uint64_t(1) << 20, uint64_t(64) << 20, 60.0);
        vshi_exit_if_new_fails(VSHI_READER_OUT_OF_MEMORY);
        std::vector<char *> kept;
        for (;;) {
            kept.push_back(new char[size_t(64) << 20]);
        }
    } else if (how == "host") { // does not serve, but reads a file by a reader, like its parent
        return read_as_host();
    } else if (how == "silent") {
        return 0;
    } else if (how == "ends") {
        return 7;
    }
    const int code = vsh_reader_serve(argc, argv);
    if (how == "long") {
        const uint64_t size = uint64_t(1) << 40;
        return pwrite(VSHI_READER_ANSWER, &size, sizeof size, offsetof(vshi_answer_head, payload)) != 8;
    }
    if (how == "code") {
        const int32_t unknown = 77;
        return pwrite(VSHI_READER_ANSWER, &unknown, sizeof unknown, offsetof(vshi_answer_head, code)) != 4;
    }
    return code;
}

// The main() of such a test.
inline int run_all_tests_or_read(int argc, char **argv) {
    const int served = as_reader(argc, argv);
    if (served >= 0) {
        _exit(served);
    }
    return make_folder() ? run_all_tests(nullptr, remove_folder) : 1;
}

inline std::vector<std::string> warned;

inline vsh_run with_reader(bool wanted = true) {
    vsh_run run = vsh_run_default();
    run.reader = wanted ? "/proc/self/exe" : nullptr;
    run.reader_seconds = wanted ? 120.0 : 0.0;
    run.warning = [](void *, const char *message) { warned.push_back(message); };
    return run;
}

// The answer of a reader for a file. `request` writes the part of the request after the path.
template <typename Request>
std::vector<unsigned char> payload_of(vshi_serve_fn *serve, const std::string &path, Request &&request) {
    static vshi_encoder encoder;
    const int asked = memfd_create("request", 0), sent = memfd_create("payload", 0);
    vshi_encoder_begin(&encoder, asked, 0);
    request(&encoder);
    assert_true(vshi_encoder_flush(&encoder));
    const auto bytes_of = [](int file, uint64_t size) {
        std::vector<unsigned char> bytes(size + 8); // never empty
        assert_int_equal(pread(file, bytes.data(), size, 0), ssize_t(size));
        bytes.resize(size);
        return bytes;
    };
    const std::vector<unsigned char> question = bytes_of(asked, encoder.size);
    vshi_decoder decoder = {question.data(), question.data() + question.size(), false};
    const vsh_run run = vsh_run_default();
    vshi_encoder_begin(&encoder, sent, 0);
    assert_int_equal(serve(path.c_str(), &decoder, &run, &encoder, &failure), VSH_OK);
    assert_true(vshi_encoder_flush(&encoder));
    const std::vector<unsigned char> bytes = bytes_of(sent, encoder.size);
    close(asked);
    close(sent);
    return bytes;
}

// Numbers that are the same in every run.
struct Random {
    uint64_t state;
    uint64_t operator()() {
        state = state * 6364136223846793005u + 1442695040888963407u;
        return state >> 33;
    }
};

// Changes a file or an answer in one to four places: a bit, or a number to one at an end of its range.
template <typename Bytes> void change_bytes(Bytes &bytes, Random &next) {
    static const uint64_t values[] = {
        0, 1, UINT64_MAX, uint64_t(1) << 63, uint64_t(1) << 32, 0x7fc00000, 0x7ff0000000000000u};
    for (uint64_t k = next() % 4 + 1; k > 0; --k) {
        // half of them near the beginning, where the counts are
        const size_t reach = next() % 2 == 0 ? std::min<size_t>(bytes.size(), 256) : bytes.size();
        const size_t at = next() % reach;
        if (next() % 2 == 0) {
            bytes[at] = static_cast<typename Bytes::value_type>(bytes[at] ^ (1u << next() % 8));
        } else {
            const uint64_t value = values[next() % (COUNT_OF(values))];
            const size_t aligned = at / 8 * 8;
            std::memcpy(bytes.data() + aligned, &value, std::min<size_t>(8, bytes.size() - aligned));
        }
    }
}

// Calls `refuses(decoder)` for a payload that is cut, or changed, `count` times. Returns how many are
// refused.
template <typename Refuses>
int damage(const std::vector<unsigned char> &whole, int count, Refuses &&refuses) {
    Random next{1};
    int refused = 0;
    for (int i = 0; i < count; ++i) {
        // an array of this size, so that a sanitizer sees reads behind its end
        std::vector<unsigned char> bytes(whole);
        change_bytes(bytes, next);
        if (next() % 4 == 0) {
            bytes.resize(next() % bytes.size() / 8 * 8);
            bytes.shrink_to_fit();
        }
        vshi_decoder decoder = {bytes.data(), bytes.data() + bytes.size(), false};
        refused += refuses(&decoder);
    }
    return refused;
}
