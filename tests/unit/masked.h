/* Cards that a texture cuts out, and what they are without one. */
#pragma once

#include "testing.h"

#include "shading.h"

/* A disc of this radius in a square of side 2, as an alpha of this many texels: a ramp that is a half at the
 * disc's edge, and some texels wide. */
#define DISC_RADIUS 0.8
enum { DISC_TEXELS = 128, DISC_SECTORS = 256 };

typedef struct card {
    float positions[12], uvs[8];
    uint32_t indices[6];
    uint8_t alpha[DISC_TEXELS * DISC_TEXELS];
    vsh_alpha_mask mask;
    vsh_mesh mesh;
} card;

static inline vsh_alpha_mask mask_of(const uint8_t *alpha, int32_t width, int32_t height) {
    return (vsh_alpha_mask){.alpha = alpha,
                            .width = width,
                            .height = height,
                            .uv_transform = {1, 0, 0, 0, 1, 0},
                            .alpha_cutoff = 0.5,
                            .base_alpha = 1.0};
}

/* A card in the plane of this height, seen from above anticlockwise: its front is up. */
static inline card *card_at(float height) {
    card *c = malloc(sizeof *c);
    for (uint32_t k = 0; k < 4; ++k) {
        const bool right = k == 1 || k == 2, far = k >= 2;
        const float at[3] = {right ? 1.0f : -1.0f, height, far ? -1.0f : 1.0f};
        memcpy(c->positions + 3 * k, at, sizeof at);
        c->uvs[2 * k] = right ? 1.0f : 0.0f;
        c->uvs[2 * k + 1] = far ? 1.0f : 0.0f;
    }
    memcpy(c->indices, (const uint32_t[]){0, 1, 2, 0, 2, 3}, sizeof c->indices);
    for (int y = 0; y < DISC_TEXELS; ++y) {
        for (int x = 0; x < DISC_TEXELS; ++x) {
            const double u = 2.0 * (x + 0.5) / DISC_TEXELS - 1.0, v = 2.0 * (y + 0.5) / DISC_TEXELS - 1.0;
            const double value = 127.5 + 2000.0 * (DISC_RADIUS - hypot(u, v));
            c->alpha[y * DISC_TEXELS + x] = (uint8_t)(fmin(255.0, fmax(0.0, value)) + 0.5);
        }
    }
    c->mask = mask_of(c->alpha, DISC_TEXELS, DISC_TEXELS);
    c->mesh = (vsh_mesh){.name = "card",
                         .positions = c->positions,
                         .indices = c->indices,
                         .vertex_count = 4,
                         .triangle_count = 2,
                         .mask = &c->mask,
                         .mask_uvs = c->uvs};
    return c;
}

/* The disc as triangles. */
typedef struct fan {
    float positions[3 * (DISC_SECTORS + 1)];
    uint32_t indices[3 * DISC_SECTORS];
    vsh_mesh mesh;
} fan;

static inline fan *fan_at(float height) {
    fan *f = malloc(sizeof *f);
    /* as large as the circle that the polygon stands for */
    const double radius = DISC_RADIUS * sqrt(2.0 * PI / DISC_SECTORS / sin(2.0 * PI / DISC_SECTORS));
    memcpy(f->positions, (const float[]){0.0f, height, 0.0f}, 3 * sizeof(float));
    for (uint32_t i = 0; i < DISC_SECTORS; ++i) {
        const double angle = 2.0 * PI * i / DISC_SECTORS;
        const float at[3] = {(float)(radius * cos(angle)), height, (float)(-radius * sin(angle))};
        memcpy(f->positions + 3 * (i + 1), at, sizeof at);
        const uint32_t corners[3] = {0, i + 1, (i + 1) % DISC_SECTORS + 1};
        memcpy(f->indices + 3 * i, corners, sizeof corners);
    }
    f->mesh = (vsh_mesh){.name = "disc",
                         .positions = f->positions,
                         .indices = f->indices,
                         .vertex_count = DISC_SECTORS + 1,
                         .triangle_count = DISC_SECTORS};
    return f;
}

static inline vshi_triangles *traced_of(const vsh_mesh *meshes, size_t count) {
    vshi_triangles *triangles = NULL;
    assert_ok(vshi_triangles_create(meshes, count, NULL, &triangles, &failure));
    return triangles;
}

/* Lookups as the standards have them. */
static inline int wrap(int at, int size, int32_t how) {
    if (how == VSH_WRAP_CLAMP) {
        return at < 0 ? 0 : at >= size ? size - 1 : at;
    }
    const int period = how == VSH_WRAP_MIRROR ? 2 * size : size;
    while (at < 0) {
        at += period;
    }
    while (at >= period) {
        at -= period;
    }
    return at < size ? at : period - 1 - at;
}

/* As the standards have it, with another sum. */
static inline double alpha_at(const vsh_alpha_mask *m, double u, double v) {
    const double *t = m->uv_transform;
    const double x = (t[0] * u + t[1] * v + t[2]) * m->width - 0.5;
    const double y = (1.0 - (t[3] * u + t[4] * v + t[5])) * m->height - 0.5;
    double sum = 0.0;
    for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 2; ++i) {
            const int column = (int)floor(x) + i, row = (int)floor(y) + j;
            const int texel =
                wrap(row, m->height, m->wrap[1]) * m->width + wrap(column, m->width, m->wrap[0]);
            sum += (1.0 - fabs(x - column)) * (1.0 - fabs(y - row)) * m->alpha[texel] / 255.0;
        }
    }
    return m->base_alpha * sum;
}

static inline double next_of(uint32_t *seed) {
    *seed = *seed * 1664525u + 1013904223u;
    return (double)(*seed >> 8) * 0x1p-24;
}

enum { WIDE = 5, HIGH = 7 };

static inline vsh_alpha_mask random_mask(uint8_t alpha[WIDE * HIGH], int i, uint32_t *seed) {
    for (int k = 0; k < WIDE * HIGH; ++k) {
        alpha[k] = (uint8_t)(next_of(seed) * 255.99);
    }
    vsh_alpha_mask mask = mask_of(alpha, WIDE, HIGH);
    mask.wrap[0] = i % 3;
    mask.wrap[1] = i / 3 % 3;
    if (i % 2 == 1) {
        const double turned[6] = {0.8, -1.7, 0.4, 1.1, 0.6, -2.3};
        memcpy(mask.uv_transform, turned, sizeof turned);
        mask.base_alpha = 0.7;
        mask.alpha_cutoff = 0.3;
    }
    return mask;
}
