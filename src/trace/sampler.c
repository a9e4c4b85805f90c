#include "trace/sampler.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MASK_EDGE = 64, CANDIDATES = 32 };

struct vshi_sampler {
    int32_t kind;
    int32_t frame;
    int32_t count;                    /* points */
    uint32_t (*net)[2];               /* sobol */
    uint32_t (*cells)[2];             /* sobol: each block in the order of its cells */
    double (*points)[2];              /* blue: progressive, in the unit disc */
    float mask[MASK_EDGE][MASK_EDGE]; /* blue: ranks in [0, 1) */
};

static const double PI = 3.14159265358979323846;

/* A hash of 32 bits without fixed patterns (Wang, Jenkins and others; constants of Wellons' prospector,
 * 2018). */
static uint32_t hash(uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}

static uint32_t hash2(uint32_t a, uint32_t b) {
    return hash(a ^ (hash(b) + 0x9e3779b9u + (a << 6) + (a >> 2)));
}

static double unit(uint32_t x) {
    return (double)x * 0x1p-32;
}

/* --- Sobol points, Owen-scrambled (Burley, 2020; with his fix of the hash of Laine and Karras, 2011) */

static uint32_t reverse(uint32_t x) {
    x = (x << 16) | (x >> 16);
    x = ((x & 0x00ff00ffu) << 8) | ((x & 0xff00ff00u) >> 8);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x & 0xf0f0f0f0u) >> 4);
    x = ((x & 0x33333333u) << 2) | ((x & 0xccccccccu) >> 2);
    x = ((x & 0x55555555u) << 1) | ((x & 0xaaaaaaaau) >> 1);
    return x;
}

static uint32_t scramble(uint32_t x, uint32_t seed) {
    x = reverse(x);
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return reverse(x);
}

/* The second dimension of Sobol's sequence: Pascal's triangle modulo 2. Its entries are products over the
 * bits of row and column (Lucas), so one step for each bit of the bits' number is enough. */
static uint32_t sobol_second(uint32_t index) {
    index ^= index >> 1 & 0x55555555u;
    index ^= index >> 2 & 0x33333333u;
    index ^= index >> 4 & 0x0f0f0f0fu;
    index ^= index >> 8 & 0x00ff00ffu;
    index ^= index >> 16;
    return reverse(index);
}

/* One Owen-scrambled net serves all texels. Each shifts its digits, which keeps every prefix of 2^k a net
 * (Kollig and Keller, "Efficient multidimensional sampling", 2002) and costs two operations a point. */
static void place_net(vshi_sampler *sampler) {
    for (uint32_t i = 0; i < (uint32_t)sampler->count; ++i) {
        const uint32_t shuffled = scramble(i, 0x9e3779b9u);
        sampler->net[i][0] = scramble(reverse(shuffled), 0x68bc21ebu);
        sampler->net[i][1] = scramble(sobol_second(shuffled), 0x02e5be93u);
    }
}

/* Sine and cosine up to π/4 by their series, to 1e-11. Bits must not depend on libm. */
static inline void small_angle(double angle, double *sine, double *cosine) {
    static const double S[] = {-1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362880.0, -1.0 / 39916800.0};
    static const double C[] = {-1.0 / 2.0,    1.0 / 24.0,       -1.0 / 720.0,
                               1.0 / 40320.0, -1.0 / 3628800.0, 1.0 / 479001600.0};
    const double x = angle * angle;
    *sine = angle * (1.0 + x * (S[0] + x * (S[1] + x * (S[2] + x * (S[3] + x * S[4])))));
    *cosine = 1.0 + x * (C[0] + x * (C[1] + x * (C[2] + x * (C[3] + x * (C[4] + x * C[5])))));
}

/* Maps the unit square to the unit disc; keeps areas, and neighbours near (Shirley and Chiu, "A low
 * distortion map between disk and square", 1997). */
static void to_disc(const double square[2], double disc[2]) {
    const double x = 2.0 * square[0] - 1.0, y = 2.0 * square[1] - 1.0;
    if (x == 0.0 && y == 0.0) {
        disc[0] = disc[1] = 0.0;
        return;
    }
    const bool wide = fabs(x) > fabs(y);
    const double radius = wide ? x : y;
    double sine, cosine; /* of the angle to the nearer axis */
    small_angle(0.25 * PI * (wide ? y / x : x / y), &sine, &cosine);
    disc[0] = radius * (wide ? cosine : sine);
    disc[1] = radius * (wide ? sine : cosine);
}

static void sort_cells(vshi_sampler *sampler) {
    const uint32_t count = (uint32_t)sampler->count;
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t size = VSHI_SAMPLER_BLOCK;
        while (size <= i / 2) {
            size *= 2;
        }
        const uint32_t begin = i < VSHI_SAMPLER_BLOCK ? 0 : size, end = begin + size;
        const uint32_t at = begin + vshi_sampler_cell(size, sampler->net[i][0], sampler->net[i][1]);
        memcpy(sampler->cells[end <= count ? at : i], sampler->net[i],
               sizeof *sampler->net); /* an incomplete block has no cells */
    }
}

const uint32_t (*vshi_sampler_cells(const vshi_sampler *sampler, uint32_t first))[2] {
    return (const uint32_t(*)[2])(sampler->cells + first);
}

/* --- blue noise */

/* Places the candidate that is farthest from all earlier points, so that every prefix is even (Mitchell,
 * "Spectrally optimal sampling for distribution ray tracing", 1991). */
static void place_blue(vshi_sampler *sampler) {
    double(*points)[2] = sampler->points;
    for (int32_t i = 0; i < sampler->count; ++i) {
        double best = -1.0;
        for (int32_t c = 0; c < CANDIDATES; ++c) {
            const uint32_t seed = hash2((uint32_t)i, (uint32_t)c);
            const double square[2] = {unit(seed), unit(hash(seed ^ 0x85ebca6bu))};
            double point[2], nearest = INFINITY;
            to_disc(square, point);
            for (int32_t j = 0; j < i; ++j) {
                const double dx = points[j][0] - point[0], dy = points[j][1] - point[1];
                const double distance = dx * dx + dy * dy;
                nearest = distance < nearest ? distance : nearest;
            }
            if (nearest > best) {
                best = nearest;
                points[i][0] = point[0];
                points[i][1] = point[1];
            }
        }
    }
}

/* Adds a bit's energy to its neighbours: a Gaussian of 1.9 texels on the torus. */
static void add_energy(double *energy, const double *kernel, int32_t at, double sign) {
    const int32_t row = at / MASK_EDGE, column = at % MASK_EDGE;
    for (int32_t y = 0; y < MASK_EDGE; ++y) {
        const int32_t ky = (y - row + MASK_EDGE) % MASK_EDGE;
        for (int32_t x = 0; x < MASK_EDGE; ++x) {
            energy[y * MASK_EDGE + x] += sign * kernel[ky * MASK_EDGE + (x - column + MASK_EDGE) % MASK_EDGE];
        }
    }
}

/* Finds the set bit in the tightest cluster, or the clear bit in the largest void. */
static int32_t extreme(const double *energy, const uint8_t *set, bool cluster) {
    int32_t best = -1;
    for (int32_t i = 0; i < MASK_EDGE * MASK_EDGE; ++i) {
        if ((set[i] != 0) == cluster &&
            (best < 0 || (cluster ? energy[i] > energy[best] : energy[i] < energy[best]))) {
            best = i;
        }
    }
    return best;
}

/* Ulichney, "The void-and-cluster method for dither array generation", 1993. */
static bool place_mask(vshi_sampler *sampler) {
    enum { TEXELS = MASK_EDGE * MASK_EDGE, FIRST = TEXELS / 10 };
    struct {
        double kernel[TEXELS], energy[TEXELS];
        uint8_t set[TEXELS];
        double first_energy[TEXELS]; /* of the even first bits */
        uint8_t first[TEXELS];
    } *p = calloc(1, sizeof *p);
    if (p == NULL) {
        return false;
    }
    for (int32_t i = 0; i < TEXELS; ++i) {
        const int32_t y = i / MASK_EDGE, x = i % MASK_EDGE;
        const int32_t dy = y < MASK_EDGE / 2 ? y : MASK_EDGE - y, dx = x < MASK_EDGE / 2 ? x : MASK_EDGE - x;
        /* 2^-(r²/5) is the Gaussian of 1.9 texels; this arithmetic gives the same bits everywhere */
        p->kernel[i] = ldexp(1.0 - 0.129449436703875 * ((dx * dx + dy * dy) % 5), -((dx * dx + dy * dy) / 5));
    }
    for (uint32_t i = 0, placed = 0; placed < FIRST; ++i) {
        const int32_t at = (int32_t)(hash(i) % TEXELS);
        if (!p->set[at]) {
            p->set[at] = 1;
            add_energy(p->energy, p->kernel, at, 1.0);
            ++placed;
        }
    }
    for (;;) { /* move bits from the tightest cluster to the largest void, until one would go back */
        const int32_t from = extreme(p->energy, p->set, true);
        p->set[from] = 0;
        add_energy(p->energy, p->kernel, from, -1.0);
        const int32_t to = extreme(p->energy, p->set, false);
        p->set[to] = 1;
        add_energy(p->energy, p->kernel, to, 1.0);
        if (to == from) {
            break;
        }
    }
    float *mask = &sampler->mask[0][0];
    memcpy(p->first, p->set, sizeof p->first);
    memcpy(p->first_energy, p->energy, sizeof p->first_energy);
    for (int32_t rank = FIRST - 1; rank >= 0; --rank) {
        const int32_t at = extreme(p->energy, p->set, true);
        p->set[at] = 0;
        add_energy(p->energy, p->kernel, at, -1.0);
        mask[at] = (float)rank / TEXELS;
    }
    for (int32_t rank = FIRST; rank < TEXELS; ++rank) {
        const int32_t at = extreme(p->first_energy, p->first, false);
        p->first[at] = 1;
        add_energy(p->first_energy, p->kernel, at, 1.0);
        mask[at] = (float)rank / TEXELS;
    }
    free(p);
    return true;
}

/* Turns a point about the centre by a part of a whole turn, 0 … 1. */
static void turn(double part, double point[2]) {
    const int quarter = (int)(4.0 * part + 0.5);
    double s, c;
    small_angle(2.0 * PI * (part - 0.25 * quarter), &s, &c);
    double x = c * point[0] - s * point[1], y = s * point[0] + c * point[1];
    for (int i = 0; i < quarter; ++i) {
        const double from = x;
        x = -y;
        y = from;
    }
    point[0] = x;
    point[1] = y;
}

double vshi_sampler_mask(const vshi_sampler *sampler, uint32_t texel, uint32_t purpose) {
    static const double GOLDEN = 0.61803398874989485;
    /* each purpose reads the mask at another place; each frame adds the golden ratio to the ranks */
    const uint32_t shift = purpose == 0 ? 0 : hash(purpose);
    const uint32_t column = ((texel & 0xffffu) + shift) % MASK_EDGE,
                   row = ((texel >> 16) + (shift >> 16)) % MASK_EDGE;
    const double part = (double)sampler->mask[row][column] + GOLDEN * (double)sampler->frame;
    return part - floor(part);
}

static void blue_point(const vshi_sampler *sampler, uint32_t texel, uint32_t purpose, int32_t index,
                       double point[2]) {
    point[0] = sampler->points[index][0];
    point[1] = sampler->points[index][1];
    turn(vshi_sampler_mask(sampler, texel, purpose), point);
}

/* --- the sampler */

vshi_sampler *vshi_sampler_create(int32_t kind, int32_t rays, int32_t frame) {
    vshi_sampler *sampler = calloc(1, sizeof *sampler);
    if (sampler == NULL) {
        return NULL;
    }
    sampler->kind = kind;
    sampler->frame = frame;
    sampler->count = rays;
    if (kind == VSH_SAMPLER_SOBOL) {
        sampler->net = calloc((size_t)rays, sizeof *sampler->net);
        sampler->cells = calloc((size_t)rays, sizeof *sampler->cells);
        if (sampler->net == NULL || sampler->cells == NULL) {
            vshi_sampler_free(sampler);
            return NULL;
        }
        place_net(sampler);
        sort_cells(sampler);
    }
    if (kind != VSH_SAMPLER_BLUE) {
        return sampler;
    }
    sampler->points = calloc((size_t)rays, sizeof *sampler->points);
    if (sampler->points == NULL || !place_mask(sampler)) {
        vshi_sampler_free(sampler);
        return NULL;
    }
    place_blue(sampler);
    return sampler;
}

void vshi_sampler_free(vshi_sampler *sampler) {
    if (sampler != NULL) {
        free(sampler->cells);
        free(sampler->net);
        free(sampler->points);
        free(sampler);
    }
}

void vshi_sampler_shift(const vshi_sampler *sampler, uint32_t texel, uint32_t purpose, uint32_t shift[2]) {
    shift[0] = hash2(hash2(texel, purpose), (uint32_t)sampler->frame);
    shift[1] = hash(shift[0]);
}

void vshi_sampler_disc(const vshi_sampler *sampler, uint32_t texel, uint32_t purpose, int32_t first,
                       int32_t count, double (*points)[2]) {
    uint32_t shift[2];
    vshi_sampler_shift(sampler, texel, purpose, shift);
    const uint32_t seed = shift[0];
    for (int32_t i = 0; i < count; ++i) {
        const uint32_t index = (uint32_t)(first + i);
        double square[2];
        switch (sampler->kind) {
        case VSH_SAMPLER_BLUE:
            blue_point(sampler, texel, purpose, first + i, points[i]);
            continue;
        case VSH_SAMPLER_WHITE:
            square[0] = unit(hash2(seed, 2 * index));
            square[1] = unit(hash2(seed, 2 * index + 1));
            break;
        default:
            square[0] = unit(sampler->net[index][0] ^ shift[0]);
            square[1] = unit(sampler->net[index][1] ^ shift[1]);
            break;
        }
        to_disc(square, points[i]);
    }
}
