/* The picture of docs/volume.md: the cloister's shadow and AO in a box of voxels, as a slice of each and as a
 * fog that fills the box. Everything but where surfaces are is read from the baked grids. Usage:
 * volume_picture MESH OUT.png */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <vdbshade/vdbshade.h>

enum { WIDE = 480, HIGH = 320, SLICE_WIDE = 240, SLICE_HIGH = 160, WIDTH = SLICE_WIDE + WIDE, FINE = 2 };

static const double LOW[3] = {-3.2, -0.2, -2.4}, UP[3] = {3.2, 2.8, 2.4};
static const double SUN[3] = {0.6, 0.75, 0.5};
static const double SLICE_AT = 0.9; /* height */
static const double EYE[3] = {4.6, 2.1, 4.4}, AT[3] = {-0.7, 0.95, -0.5};
static const double ANGLE = 0.56; /* tangent of half the view's width */
static const double FOG = 0.1;    /* extinction, per unit */
static const float SUNLIGHT[3] = {1.0f, 0.86f, 0.66f}, SKYLIGHT[3] = {0.30f, 0.40f, 0.55f};

static vsh_error error;
static float planes[3][WIDTH * HIGH];

static void check(vsh_result result) {
    if (result != VSH_OK) {
        fprintf(stderr, "volume_picture: %s\n", error.message);
        exit(1);
    }
}

static void put(int x, int y, const float rgb[3]) {
    for (int c = 0; c < 3; ++c) {
        planes[c][y * WIDTH + x] = rgb[c];
    }
}

static float value_at(const vsh_volume *volume, size_t grid, const double p[3]) {
    float value;
    check(vsh_volume_sample(volume, grid, 1, p, &value, &error));
    return value;
}

static float distance_at(const vsh_field *field, const double p[3]) {
    float h;
    vsh_field_sample(field, 1, p, &h);
    return h;
}

/* Visibility, then AO below it; solids are brown. */
static void draw_slices(const vsh_field *field, const vsh_volume *volume) {
    static const float solid[3] = {0.42f, 0.33f, 0.27f};
    for (int y = 0; y < 2 * SLICE_HIGH; ++y) {
        const size_t grid = y < SLICE_HIGH ? 0 : 1;
        for (int x = 0; x < SLICE_WIDE; ++x) {
            float rgb[3] = {0.0f, 0.0f, 0.0f};
            for (int s = 0; s < 16; ++s) {
                const double u = (x + (s % 4 + 0.5) / 4) / SLICE_WIDE;
                const double v = (y % SLICE_HIGH + (s / 4 + 0.5) / 4) / SLICE_HIGH;
                const double p[3] = {LOW[0] + u * (UP[0] - LOW[0]), SLICE_AT, LOW[2] + v * (UP[2] - LOW[2])};
                const bool inside = distance_at(field, p) < 0.0f;
                for (int c = 0; c < 3; ++c) {
                    rgb[c] += (inside ? solid[c] : value_at(volume, grid, p)) / 16.0f;
                }
            }
            put(x, y, rgb);
        }
    }
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void unit(double v[3]) {
    const double length = sqrt(dot(v, v));
    for (int k = 0; k < 3; ++k) {
        v[k] /= length;
    }
}

static void along(const double origin[3], const double direction[3], double t, double p[3]) {
    for (int k = 0; k < 3; ++k) {
        p[k] = origin[k] + t * direction[k];
    }
}

/* Part of a ray that is in the box. */
static bool clip(const double direction[3], double *begin, double *end) {
    *begin = 0.0;
    *end = INFINITY;
    for (int k = 0; k < 3; ++k) {
        const double a = (LOW[k] - EYE[k]) / direction[k], b = (UP[k] - EYE[k]) / direction[k];
        *begin = fmax(*begin, fmin(a, b));
        *end = fmin(*end, fmax(a, b));
    }
    return *begin < *end;
}

/* Light of sun and sky at a surface, from the voxels around it. */
static void shade_surface(const vsh_field *field, const vsh_volume *volume, const double p[3], float rgb[3]) {
    static const double step = 0.02;
    double normal[3];
    for (int k = 0; k < 3; ++k) {
        double a[3] = {p[0], p[1], p[2]}, b[3] = {p[0], p[1], p[2]};
        a[k] -= step;
        b[k] += step;
        normal[k] = (double)distance_at(field, b) - (double)distance_at(field, a);
    }
    unit(normal);
    double sun[3] = {SUN[0], SUN[1], SUN[2]};
    unit(sun);
    const float direct = (float)fmax(0.0, dot(normal, sun)) * value_at(volume, 0, p);
    const float ambient = value_at(volume, 1, p);
    for (int c = 0; c < 3; ++c) {
        rgb[c] = 0.75f * (1.5f * SUNLIGHT[c] * direct + SKYLIGHT[c] * ambient);
    }
}

/* Fog in front of a surface, or of the sky: single scattering, the step as short as a voxel. */
static void trace(const vsh_field *field, const vsh_volume *volume, const double direction[3], float rgb[3]) {
    static const float sky[3] = {0.62f, 0.71f, 0.80f};
    double begin, end, clear = 1.0, p[3];
    float light[3] = {0.0f, 0.0f, 0.0f}, behind[3] = {sky[0], sky[1], sky[2]};
    if (clip(direction, &begin, &end)) {
        double hit = begin;
        for (int i = 0; i < 400 && hit < end; ++i) {
            along(EYE, direction, hit, p);
            const double h = (double)distance_at(field, p);
            if (h < 0.001) {
                shade_surface(field, volume, p, behind);
                break;
            }
            hit += h;
        }
        hit = fmin(hit, end);
        const int steps = 1 + (int)((hit - begin) / 0.025);
        const double step = (hit - begin) / steps, share = 1.0 - exp(-FOG * step);
        for (int i = 0; i < steps; ++i) {
            along(EYE, direction, begin + (i + 0.5) * step, p);
            const float sun = value_at(volume, 0, p), ao = value_at(volume, 1, p);
            for (int c = 0; c < 3; ++c) {
                light[c] += (float)(clear * share) * (1.5f * SUNLIGHT[c] * sun + 0.8f * SKYLIGHT[c] * ao);
            }
            clear *= 1.0 - share;
        }
    }
    for (int c = 0; c < 3; ++c) {
        const float all = light[c] + (float)clear * behind[c];
        rgb[c] += powf(all / (1.0f + 0.25f * all), 1.0f / 2.2f);
    }
}

static void draw_fog(const vsh_field *field, const vsh_volume *volume) {
    double ahead[3] = {AT[0] - EYE[0], AT[1] - EYE[1], AT[2] - EYE[2]};
    unit(ahead);
    double right[3] = {-ahead[2], 0.0, ahead[0]};
    unit(right);
    const double up[3] = {right[1] * ahead[2] - right[2] * ahead[1],
                          right[2] * ahead[0] - right[0] * ahead[2],
                          right[0] * ahead[1] - right[1] * ahead[0]};
    for (int y = 0; y < HIGH; ++y) {
        for (int x = 0; x < WIDE; ++x) {
            float rgb[3] = {0.0f, 0.0f, 0.0f};
            for (int s = 0; s < FINE * FINE; ++s) {
                const double u = (2.0 * (x + (s % FINE + 0.5) / FINE) - WIDE) / WIDE * ANGLE;
                const double v = (HIGH - 2.0 * (y + (s / FINE + 0.5) / FINE)) / WIDE * ANGLE;
                double direction[3];
                for (int k = 0; k < 3; ++k) {
                    direction[k] = ahead[k] + u * right[k] + v * up[k];
                }
                unit(direction);
                trace(field, volume, direction, rgb);
            }
            for (int c = 0; c < 3; ++c) {
                rgb[c] /= FINE * FINE;
            }
            put(SLICE_WIDE + x, y, rgb);
        }
    }
}

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: volume_picture MESH OUT.png\n");
        return 2;
    }
    static const double still[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    vsh_caster caster = {.type = VSH_CASTER_MESH, .path = argv[1]};
    for (int k = 0; k < 12; ++k) {
        caster.transform[k] = still[k];
    }
    vsh_light sun = vsh_light_default();
    for (int k = 0; k < 3; ++k) {
        sun.direction[k] = SUN[k];
    }
    sun.angle = 3.0 * 3.14159265358979 / 180.0;
    vsh_volume_options options = vsh_volume_options_default();
    options.ao = 1;
    options.shade.ao_distance = 1.0;
    options.shade.max_error = 0.005f;
    vsh_scene scene = {.casters = &caster,
                       .caster_count = 1,
                       .lights = &sun,
                       .light_count = 1,
                       .grid = vsh_grid_options_default(),
                       .shade = options.shade,
                       .ao = 1};
    scene.grid.resolution = 384;
    vsh_assets *assets;
    vsh_grid *grid;
    vsh_voxels *voxels;
    vsh_field *field;
    vsh_volume *volume;
    vsh_occluders *occluders;
    vsh_occluder_parts parts = vsh_occluder_parts_default();
    vsh_field_options reach = vsh_field_options_default();
    check(vsh_assets_load(&scene, NULL, &assets, &error));
    check(vsh_scene_casters(&scene, assets, NULL, &grid, &error));
    check(vsh_voxels_from_box(LOW, UP, 0.025, NULL, &voxels, &error));
    reach.reach = vsh_scene_reach(&scene, grid, LOW, UP);
    check(vsh_field_create(grid, &reach, NULL, &field, &error));
    parts.field = field;
    check(vsh_occluders_from_parts(&parts, &occluders, &error));
    check(vsh_bake_volume(occluders, voxels, &sun, 1, &options, NULL, &volume, NULL, &error));
    draw_slices(field, volume);
    draw_fog(field, volume);
    static const char *const names[3] = {"R", "G", "B"};
    const float *const rows[3] = {planes[0], planes[1], planes[2]};
    const vsh_image image = {WIDTH, HIGH, 3, names, rows, NULL};
    vsh_image_options bits = vsh_image_options_default();
    bits.bits = 8;
    check(vsh_image_write(argv[2], &image, &bits, &error));
    vsh_volume_free(volume);
    vsh_occluders_free(occluders);
    vsh_field_free(field);
    vsh_voxels_free(voxels);
    vsh_grid_free(grid);
    vsh_assets_free(assets);
    return 0;
}
