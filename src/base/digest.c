/* SHA-256 of files, by libmd, whose state the processor takes whole blocks into where it can. */
#include "base/digest.h"

#include "base/file.h"

#include <sha256.h>
#include <stdio.h>

#if defined(__x86_64__)
#include <cpuid.h>
#include <immintrin.h>
#endif

_Static_assert(VSH_DIGEST_TEXT == SHA256_DIGEST_STRING_LENGTH, "a digest's text");

/* --- blocks of 64 bytes by the processor's own instructions. The registers' order (ABEF, CDGH) is theirs: S.
 * Gulley et al., "Intel SHA Extensions", 2013 */

#if defined(__x86_64__)

static bool has_instructions(void) {
    enum { LEAF = 7, SHA = 1 << 29 };
    unsigned a, b, c, d;
    return __builtin_cpu_supports("sse4.1") && __get_cpuid_count(LEAF, 0, &a, &b, &c, &d) && (b & SHA) != 0;
}

static const uint32_t constants[64] = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

__attribute__((target("sha,sse4.1"))) static void take_blocks(uint32_t state[8], const unsigned char *bytes,
                                                              size_t count) {
    enum { BLOCK = 64, GROUPS = 16, SCHEDULED = 12 };
    const __m128i swap = _mm_set_epi64x(0x0c0d0e0f08090a0b, 0x0405060700010203);
    const __m128i *const k = (const __m128i *)(const void *)constants;
    __m128i *const out = (__m128i *)(void *)state;
    const __m128i badc = _mm_shuffle_epi32(_mm_loadu_si128(out), 0xb1);
    const __m128i efgh = _mm_shuffle_epi32(_mm_loadu_si128(out + 1), 0x1b);
    __m128i abef = _mm_alignr_epi8(badc, efgh, 8), cdgh = _mm_blend_epi16(efgh, badc, 0xf0);
    for (; count > 0; --count, bytes += BLOCK) {
        const __m128i abef_before = abef, cdgh_before = cdgh;
        __m128i w[4];
        for (int i = 0; i < 4; ++i) {
            w[i] = _mm_shuffle_epi8(_mm_loadu_si128((const __m128i *)(const void *)bytes + i), swap);
        }
#pragma GCC unroll 16
        for (int i = 0; i < GROUPS; ++i) { /* four rounds each */
            const __m128i sum = _mm_add_epi32(w[i % 4], _mm_loadu_si128(k + i));
            cdgh = _mm_sha256rnds2_epu32(cdgh, abef, sum);
            abef = _mm_sha256rnds2_epu32(abef, cdgh, _mm_shuffle_epi32(sum, 0x0e));
            if (i < SCHEDULED) {
                const __m128i last = w[(i + 3) % 4], before = w[(i + 2) % 4];
                const __m128i next = _mm_add_epi32(_mm_sha256msg1_epu32(w[i % 4], w[(i + 1) % 4]),
                                                   _mm_alignr_epi8(last, before, 4));
                w[i % 4] = _mm_sha256msg2_epu32(next, last);
            }
        }
        abef = _mm_add_epi32(abef, abef_before);
        cdgh = _mm_add_epi32(cdgh, cdgh_before);
    }
    const __m128i feba = _mm_shuffle_epi32(abef, 0x1b), dchg = _mm_shuffle_epi32(cdgh, 0xb1);
    _mm_storeu_si128(out, _mm_blend_epi16(feba, dchg, 0xf0));
    _mm_storeu_si128(out + 1, _mm_alignr_epi8(dchg, feba, 8));
}

#else

static bool has_instructions(void) {
    return false;
}

static void take_blocks(uint32_t state[8], const unsigned char *bytes, size_t count) {
    (void)state;
    (void)bytes;
    (void)count;
}

#endif

/* --- files */

static void update(SHA2_CTX *context, bool fast, const unsigned char *bytes, size_t count) {
    const size_t blocks =
        fast && context->bitcount[0] % (8 * SHA256_BLOCK_LENGTH) == 0 ? count / SHA256_BLOCK_LENGTH : 0;
    const size_t done = blocks * SHA256_BLOCK_LENGTH;
    if (blocks > 0) {
        take_blocks(context->state.st32, bytes, blocks);
        context->bitcount[0] += 8 * (uint64_t)done;
    }
    SHA256Update(context, bytes + done, count - done);
}

static vsh_result digest_stream(FILE *file, const char *path, char *digest, vshi_job *job, vsh_error *error) {
    SHA2_CTX context;
    SHA256Init(&context);
    const bool fast = has_instructions();
    unsigned char bytes[1 << 14];
    size_t count;
    while ((count = fread(bytes, 1, sizeof bytes, file)) > 0) {
        update(&context, fast, bytes, count);
        if (vshi_job_advance(job, 0)) {
            return vshi_job_fail_cancelled(job, error);
        }
    }
    if (ferror(file)) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read", path);
    }
    SHA256End(&context, digest);
    return VSH_OK;
}

vsh_result vshi_file_digest(const char *path, char digest[VSH_DIGEST_TEXT], vshi_job *job, vsh_error *error) {
    FILE *file;
    uint64_t size;
    vsh_result result = vshi_input_open(path, path, UINT64_MAX, &file, &size, error);
    if (result != VSH_OK) {
        return result;
    }
    result = digest_stream(file, path, digest, job, error);
    fclose(file);
    return result;
}

vsh_result vsh_file_digest(const char *path, const vsh_run *run, char digest[VSH_DIGEST_TEXT],
                           vsh_error *error) {
    VSHI_NEEDS(path);
    VSHI_NEEDS(digest);
    if (path[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "digest: no path");
    }
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vshi_job *job = vshi_job_begin(&full, "hash", 1);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    const vsh_result result = vshi_file_digest(path, digest, job, error);
    vshi_job_end(job);
    return result;
}
