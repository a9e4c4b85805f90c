/* Results, errors and run options: what every call of vdbshade shares.
 *
 * What holds for every call, and is not said again at each:
 *
 * - The library prints nothing, ends nothing and keeps no state of its own. It begins threads only within
 *   calls that take a vsh_run. With the first level set it loads OpenVDB, with the first image other than
 *   EXR and PNG OpenImageIO, and with the first rays against triangles Embree; they stay, and four threads
 *   of liblog4cplus with them, which wait. VSH_ERROR_UNSUPPORTED where such a module cannot be had.
 * - A call that can fail returns a vsh_result and fills the caller's vsh_error.
 * - Every function may be called by several threads at once. Handles are immutable once made and may be
 *   shared by threads; each is freed once, when no call uses it any more.
 * - Pointers must not be NULL but where that is said, for arrays of no elements, and for parameters named
 *   options, run, stats or error: NULL options and a NULL run stand for what their …_default() gives. A call
 *   that returns a vsh_result answers any other NULL with VSH_ERROR_ARGUMENT, and says which it is.
 * - Arrays and structs that are passed in stay the caller's and are not used after the call.
 * - Arrays of voxels are [depth][height][width]: x fastest, then y, then z, as images have columns fastest. A
 *   texel is one number everywhere: vsh_texel() (points.h).
 * - A call that makes a handle leaves NULL in its place where it fails.
 * - Structs of options begin with struct_size, which their …_default() or …_zero() function sets. They may
 *   get more members at their end; programs that were compiled against an older header then go on working.
 *   VSH_ERROR_ARGUMENT if struct_size is 0, more than this library knows, or the size of no such struct. All
 *   else changes with the library's soname alone, which is that of the minor version.
 * - Calls compute in the default floating-point environment (round to nearest, denormals kept, no traps),
 *   whatever the caller has set, which is given back. Callbacks are called in the default one.
 * - Every call works on a stack of 128 KiB, of a thread or of a fibre. A call that finds less than 2 MiB left
 *   does its work on threads of its own with 4 MiB and waits for them, which takes up to a millisecond more.
 *   VSH_ERROR_MEMORY where the system refuses such a thread. Callbacks then come from these threads.
 * - Files that somebody else made: the libraries that parse .vdb files, meshes, images and fonts can crash on
 *   damaged ones. With vsh_run.reader they run in a child process, confined, that hands over plain arrays;
 *   everything in these is checked, and a crash, a hang or hunger there is an error here (reader.h). The
 *   child comes by posix_spawn(), which runs nothing of this process between fork and exec, so it is safe in
 *   a host with threads, handlers and locks. Calls without a reader are for files that are trusted.
 * - VSH_ERROR_MEMORY (the system refused memory) and VSH_ERROR_INTERNAL can come from every call that returns
 *   a vsh_result, VSH_ERROR_CANCELLED from every one that takes a run; the rest is listed at each call. */
#ifndef VDBSHADE_BASE_H
#define VDBSHADE_BASE_H

#include <stddef.h>
#include <stdint.h>

/* Before what the library shows. */
#if defined(VSH_BUILD) && defined(__GNUC__)
#define VSH_API __attribute__((visibility("default")))
#else
#define VSH_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The version of these headers; the library's is vsh_version(). */
#define VSH_VERSION_MAJOR 0
#define VSH_VERSION_MINOR 2
#define VSH_VERSION_PATCH 0

/* "0.2.0"; a static string. */
VSH_API const char *vsh_version(void);

/* What a call came to. Zero is success; every other value comes with a message in the caller's vsh_error. */
typedef int32_t vsh_result;
enum {
    VSH_OK = 0,
    VSH_ERROR_ARGUMENT = 1,    /* a parameter or option is out of its range */
    VSH_ERROR_INPUT = 2,       /* the content of a file, mesh, grid or scene is bad */
    VSH_ERROR_READ = 3,        /* a file could not be read */
    VSH_ERROR_WRITE = 4,       /* a file could not be written; the old one is as it was */
    VSH_ERROR_LIMIT = 5,       /* a memory or size limit would be passed; found before memory is taken */
    VSH_ERROR_MEMORY = 6,      /* the system refused memory */
    VSH_ERROR_CANCELLED = 7,   /* the progress callback asked to stop */
    VSH_ERROR_UNSUPPORTED = 8, /* valid input that this build does not handle */
    VSH_ERROR_INTERNAL = 9     /* a defect of this library */
};

/* Name of a result, "VSH_ERROR_INPUT"; "VSH_ERROR_UNKNOWN" for other values. A static string. */
VSH_API const char *vsh_result_name(vsh_result result);

/* Filled by a call that fails; left alone by one that succeeds. The message is one line without control
 * characters, ends in NUL, and names file, place, value and limit where there are such. */
typedef struct vsh_error {
    vsh_result code;    /* VSH_ERROR_… */
    char message[1020]; /* what failed, in a line */
} vsh_error;

/* For bindings of other languages, which cannot call inline functions: what the …_default() or …_zero() of a
 * struct gives, by its name ("vsh_run"), into `size` bytes, as many as they know of it. 1; or 0 where there
 * is no such struct, or an argument is NULL. */
VSH_API int32_t vsh_struct_init(const char *name, void *made, size_t size);

/* A line of text that a file carries beside its values (provenance.h makes some). */
typedef struct vsh_attribute {
    const char *name; /* "vdbshade_version"; 1 … 79 bytes of printable ASCII without blanks, no two alike */
    const char *value; /* UTF-8 without control characters, at most 65535 bytes */
} vsh_attribute;

/* Told the stage ("load", "outline", "voxelize", "field", "charts", "texels", "validate", "shadow.NAME",
 * "ao", "padding", "volume", "flat", "hash", "compare", "page", "unwrap", "pack", "lit", "parts", "merge")
 * and the fraction done of it, 0 … 1, never falling within a stage. Called by one thread at a time, from any
 * of the pool's threads. Return 0 to go on; anything else cancels: the call frees what it took and returns
 * VSH_ERROR_CANCELLED. At 1 a stage's work may be done, and what is returned be left alone: who wants to
 * cancel says so at every call from then on. */
typedef int32_t vsh_progress_fn(void *user, const char *stage, double fraction);

/* Gets a warning: what changes the result, and what the user can do about it. One line without a newline. If
 * vsh_run.notes is set it gets notes too, which begin with "note: ". They say what the library decided, and
 * need no action ("note: mesh 'sail' (1 of 1): 4 open edges: …"). Same calling rules as vsh_progress_fn. */
typedef void vsh_warning_fn(void *user, const char *message);

/* A progress callback that hands on to another from time to time: for languages whose callbacks take long, or
 * may be called by one thread alone. As vsh_run.progress goes vsh_progress_seldom(), as vsh_run.user the
 * address of this, which is one call's. */
typedef struct vsh_progress_filter {
    size_t struct_size;
    vsh_progress_fn *progress; /* handed on to with `user`: 0 and 1 of a stage, and in between at most every
                                  `seconds`; else work goes on. What it answers other than 0 stays. May be
                                  NULL */
    void *user;                /* of `progress` */
    double seconds;            /* by the clock, ≥ 0 */
    uint64_t thread;  /* nonzero: that thread alone hands on, (uint64_t)pthread_self(); the one that makes a
                         call takes part in its work, if it has a stack of 4 MiB */
    double last;      /* these two are kept by vsh_progress_seldom(): when it handed on last, 0: not yet; */
    int32_t answered; /* and what the callback answered */
} vsh_progress_filter;

static inline vsh_progress_filter vsh_progress_filter_default(void) {
    vsh_progress_filter filter = {sizeof(vsh_progress_filter), NULL, NULL, 0.02, 0, 0.0, 0};
    return filter;
}

/* A vsh_progress_fn: `filter` points to a vsh_progress_filter. */
VSH_API int32_t vsh_progress_seldom(void *filter, const char *stage, double fraction);

/* Instruction sets that the marching kernels are built for. Other parts of the library have one build; Embree
 * chooses its own. */
enum {
    VSH_ISA_BEST = 0,  /* the best that this machine has */
    VSH_ISA_BASE = 1,  /* what every processor of the kind has: SSE2 on x86-64, Neon on Arm */
    VSH_ISA_AVX2 = 2,  /* x86-64 only, as the next */
    VSH_ISA_AVX512 = 3 /* F, DQ and VL */
};

/* Kinds of names in files and on command lines. VSH_NAMES_SHADOW stands for the names of VSH_SHADOW_…. */
enum {
    VSH_NAMES_ISA = 0,
    VSH_NAMES_SHADOW = 1,           /* method.h */
    VSH_NAMES_AO = 2,               /* method.h */
    VSH_NAMES_SAMPLER = 3,          /* method.h */
    VSH_NAMES_FALLOFF = 4,          /* light.h */
    VSH_NAMES_COLOR = 5,            /* image.h */
    VSH_NAMES_ALIGN = 6,            /* outline.h */
    VSH_NAMES_ATLAS = 7,            /* unwrap.h */
    VSH_NAMES_COMBINE = 8,          /* layer.h */
    VSH_NAMES_TINT = 9,             /* shade.h */
    VSH_NAMES_BENT = 10,            /* bake.h */
    VSH_NAMES_UP = 11,              /* bake.h: "-x" is VSH_UP_MINUS_X */
    VSH_NAMES_SEAMS = 12,           /* bake.h */
    VSH_NAMES_INSIDE = 13,          /* volume.h */
    VSH_NAMES_FLAT = 14,            /* flat.h: methods */
    VSH_NAMES_FLAT_LIGHT = 15,      /* flat.h: VSH_LIGHT_… in a plane, "directional", "disc", "spot" */
    VSH_NAMES_RECEIVER_UNWRAP = 16, /* scene.h */
    VSH_NAMES_MEASURE = 17          /* compare.h */
};

/* Finds the constant that a name stands for: VSH_SHADOW_CONE for "cone" of VSH_NAMES_SHADOW. -1: the name is
 * NULL or unknown, or no VSH_NAMES_… is `kind`. */
VSH_API int32_t vsh_find_name(int32_t kind, const char *name);

/* Gets the name of a constant, a static string; NULL: unknown value or kind. A kind's values are 0, 1, … */
VSH_API const char *vsh_get_name(int32_t kind, int32_t value);

/* Whether this machine has an instruction set: 1 or 0, which it is for what is none. */
VSH_API int32_t vsh_isa_available(int32_t isa);

/* How to run, the same for every call that takes long. */
typedef struct vsh_run {
    size_t struct_size;    /* sizeof(vsh_run), set by vsh_run_default() */
    int32_t threads;       /* 0 … 1024, else VSH_ERROR_ARGUMENT; 0: all cores. No result depends on it */
    uint64_t memory_limit; /* bytes that one call may hold, with the handles given to it, by an estimate
                              made beforehand; else VSH_ERROR_LIMIT. 0: no limit */
    vsh_progress_fn *progress; /* may be NULL */
    vsh_warning_fn *warning;   /* may be NULL */
    void *user;                /* handed to both */
    int32_t isa; /* VSH_ISA_…, to test one; VSH_ERROR_ARGUMENT where this machine lacks it. No result depends
                    on it */
    /* program that parses files: VSH_READER (reader.h), which comes with this library, or another whose main
     * calls vsh_reader_serve(), found as by execvp(). NULL: files are parsed in this process, where a damaged
     * one can crash it. No result depends on it */
    const char *reader;
    double reader_seconds; /* that the reader may take for one file, by the clock, > 0; else VSH_ERROR_LIMIT.
                              0: 60, and one more for each MB of the file */
    int32_t confined; /* 1: where the system refuses one of the reader's confinements (reader.h) nothing is
                         read: VSH_ERROR_UNSUPPORTED; needs a reader, else VSH_ERROR_ARGUMENT. 0: a warning,
                         but where only Landlock is missing */
    int32_t allow_outside; /* 1: what a model names (buffers, materials) may lie outside its folder. 0: such a
                              file is not opened: VSH_ERROR_INPUT */
    uint64_t memory_held;  /* bytes of memory_limit that the caller holds beside what it gives to the call:
                              images read before, say */
    int32_t notes;         /* 1: `warning` gets notes too */
} vsh_run;

static inline vsh_run vsh_run_default(void) {
    vsh_run run = {sizeof(vsh_run), 0, 0, NULL, NULL, NULL, VSH_ISA_BEST, NULL, 0.0, 0, 0, 0, 0};
    return run;
}

#ifdef __cplusplus
}
#endif
#endif
