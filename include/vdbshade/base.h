/* Results, errors, and options of a run: what all calls share.
 *
 *     vsh_run run = vsh_run_default();
 *     run.threads = 4;
 *     run.warning = print_warning; // a vsh_warning_fn
 *     run.reader = VSH_READER; // parse files in a confined process
 *     vsh_error error;
 *     vsh_model *model;
 *     if (vsh_model_read("room.glb", &run, &model, &error) != VSH_OK) {
 *         fprintf(stderr, "%s\n", error.message);
 *     }
 *
 * Link with -lvdbshade -lm: inline functions of the headers use sqrt().
 *
 * These rules hold for every call:
 *
 * - The library prints nothing, never exits, and keeps no mutable global state. Only calls that take a
 *   vsh_run start threads. OpenVDB is loaded with the first level set, OpenImageIO with the first image
 *   other than EXR and PNG, Embree with the first rays against triangles. They stay loaded; liblog4cplus
 *   keeps four waiting threads. VSH_ERROR_UNSUPPORTED if a library is missing.
 * - A call that can fail returns a vsh_result and fills the caller's vsh_error.
 * - Any thread may call any function at any time. Handles do not change once made, and threads may share
 *   them. Free each handle once, when no call uses it.
 * - Pointers must not be NULL unless the docs allow it. Exceptions: arrays without elements, and parameters
 *   named options, run, stats, report or error. NULL options and a NULL run mean their …_default(). Calls
 *   that return a vsh_result answer any other NULL with VSH_ERROR_ARGUMENT.
 * - Arrays and structs that you pass in stay yours. The library does not use them after the call, unless the
 *   docs call them views.
 * - Voxels are stored as [depth][height][width]: x fastest, then y, then z. Image rows are stored likewise.
 * - A call that makes a handle sets it to NULL if it fails.
 * - Structs of options begin with struct_size. Their …_default() or …_zero() function sets it. Later
 *   versions may append members, and older programs keep working. All else may change with the minor
 *   version, which is the library's soname. VSH_ERROR_ARGUMENT if struct_size is 0 or larger than the
 *   library knows.
 * - Calls compute in the default floating-point environment (round to nearest, denormals kept, no traps) and
 *   restore the caller's. Callbacks run in the default one.
 * - Call from threads, or fibres, with a stack of at least 1 MiB.
 * - Libraries that parse .vdb files, meshes, images and fonts can crash on damaged ones. With vsh_run.reader
 *   they run in a confined child process, and the caller checks everything that comes back. posix_spawn()
 *   starts the child, so this is safe in hosts with threads and locks. Without a reader, read only files
 *   that you trust.
 * - VSH_ERROR_MEMORY and VSH_ERROR_INTERNAL can come from every call that returns a vsh_result, and
 *   VSH_ERROR_CANCELLED from every one that takes a run. The docs of each call list the others.
 *   "VSH_ERROR_ARGUMENT: run" means a member of vsh_run out of range. */
#pragma once

#include <stddef.h>
#include <stdint.h>

/* Marks the functions of the library. VSH_BUILD is defined while the library itself is compiled. Programs for
 * Windows that link the static library define VSH_STATIC. */
#if defined(_WIN32) && defined(VSH_BUILD)
#define VSH_API __declspec(dllexport)
#elif defined(_WIN32) && !defined(VSH_STATIC)
#define VSH_API __declspec(dllimport)
#elif defined(__GNUC__) && !defined(_WIN32)
#define VSH_API __attribute__((visibility("default")))
#else
#define VSH_API
#endif

/* Open and close a block of C declarations for C++ programs. */
#ifdef __cplusplus
#define VSH_BEGIN_C extern "C" {
#define VSH_END_C }
#else
#define VSH_BEGIN_C
#define VSH_END_C
#endif

VSH_BEGIN_C

/* The version of these headers; vsh_version() returns the library's. */
#define VSH_VERSION_MAJOR 0
#define VSH_VERSION_MINOR 2
#define VSH_VERSION_PATCH 0

/* "0.2.0"; a static string. */
VSH_API const char *vsh_version(void);

/* The result of a call. Every value but VSH_OK comes with a message in the caller's vsh_error. */
typedef enum vsh_result {
    VSH_OK = 0,
    VSH_ERROR_ARGUMENT = 1,  /* a parameter or option is out of range */
    VSH_ERROR_INPUT = 2,     /* a file, mesh, grid or scene has bad content */
    VSH_ERROR_READ = 3,      /* a file could not be read */
    VSH_ERROR_WRITE = 4,     /* a file could not be written; the old one is unchanged */
    VSH_ERROR_LIMIT = 5,     /* a limit of memory or size would be exceeded; checked before memory is taken */
    VSH_ERROR_MEMORY = 6,    /* the system refused memory */
    VSH_ERROR_CANCELLED = 7, /* the progress callback asked to stop */
    VSH_ERROR_UNSUPPORTED = 8, /* valid input that this build does not handle */
    VSH_ERROR_INTERNAL = 9     /* a defect of this library */
} vsh_result;

/* The name of a result, "VSH_ERROR_INPUT"; "VSH_ERROR_UNKNOWN" for other values. A static string. */
VSH_API const char *vsh_result_name(vsh_result result);

/* Calls that fail fill it; calls that succeed leave it alone. The message is one line without control
 * characters. It names the file, the place, the value and the limit. */
typedef struct vsh_error {
    vsh_result code;    /* VSH_ERROR_… */
    char message[1020]; /* ends in NUL */
} vsh_error;

/* A line of text that a file carries beside its values, such as those of vsh_provenance_create(). */
typedef struct vsh_attribute {
    const char *name;  /* "vdbshade_version"; unique, 1 … 79 bytes of printable ASCII without blanks */
    const char *value; /* UTF-8 without control characters, at most 65535 bytes */
} vsh_attribute;

/* Receives the progress of a call: a stage ("load", "outline", "voxelize", "field", "charts", "texels",
 * "shadow.NAME", "ao", "padding", "volume", "flat", "hash", "compare", "page", "unwrap", "pack",
 * "lit", "parts", "merge") and the fraction of it that is done, 0 … 1, which never falls within a stage. One
 * thread calls it at a time, but any thread of the pool may. Return 0 to continue, anything else to cancel:
 * the call then frees its memory and returns VSH_ERROR_CANCELLED. At a fraction of 1 the library may ignore
 * the result, so keep returning nonzero until the call returns. */
typedef int32_t vsh_progress_fn(void *user, const char *stage, double fraction);

/* Receives a warning, one line without a newline: what changes the result, and what the user can do about it.
 * If vsh_run.notes is set, it also receives notes, which begin with "note: ". They report what the library
 * decided and need no action ("note: mesh 'sail' (1 of 1): 4 open edges: …"). Threads call it as
 * vsh_progress_fn. */
typedef void vsh_warning_fn(void *user, const char *message);

/* Instruction sets that the marching kernels are built for. The rest of the library has one build; Embree
 * picks its own. */
typedef enum vsh_isa {
    VSH_ISA_BEST = 0,  /* the best that this machine has */
    VSH_ISA_BASE = 1,  /* SSE2 on x86-64, Neon on Arm */
    VSH_ISA_AVX2 = 2,  /* x86-64 only */
    VSH_ISA_AVX512 = 3 /* x86-64 only: AVX-512 F, DQ and VL */
} vsh_isa;

/* Kinds of names in files and on command lines: VSH_NAMES_SHADOW selects the names of the VSH_SHADOW_…
 * constants, and so on. */
typedef enum vsh_names {
    VSH_NAMES_ISA = 0,
    VSH_NAMES_SHADOW = 1,
    VSH_NAMES_AO = 2,
    VSH_NAMES_SAMPLER = 3,
    VSH_NAMES_FALLOFF = 4,
    VSH_NAMES_COLOR = 5,
    VSH_NAMES_ALIGN = 6,
    VSH_NAMES_ATLAS = 7,
    VSH_NAMES_COMBINE = 8,
    VSH_NAMES_TINT = 9,
    VSH_NAMES_BENT = 10,
    VSH_NAMES_UP = 11, /* "-x" is VSH_UP_MINUS_X */
    VSH_NAMES_SEAMS = 12,
    VSH_NAMES_INSIDE = 13,
    VSH_NAMES_FLAT_LIGHT = 14, /* VSH_LIGHT_… in a plane: "directional", "disc", "spot" */
    VSH_NAMES_RECEIVER_UNWRAP = 15,
    VSH_NAMES_MEASURE = 16
} vsh_names;

/* Returns the constant of a name: VSH_SHADOW_CONE for "cone" of VSH_NAMES_SHADOW. -1 if the name is NULL or
 * unknown, or the kind is unknown. */
VSH_API int32_t vsh_find_name(vsh_names kind, const char *name);

/* Returns the name of a constant, a static string; NULL for an unknown value or kind. The values of a kind
 * are 0, 1, 2, … */
VSH_API const char *vsh_get_name(vsh_names kind, int32_t value);

/* Options of every call that takes long. */
typedef struct vsh_run {
    size_t struct_size;        /* sizeof(vsh_run), set by vsh_run_default() */
    int32_t threads;           /* 0 … 1024; 0: all cores. Results do not depend on it */
    uint64_t memory_limit;     /* bytes that one call may hold, with the handles given to it; 0: no limit. The
                                  call estimates its memory first, and fails with VSH_ERROR_LIMIT */
    vsh_progress_fn *progress; /* may be NULL */
    vsh_warning_fn *warning;   /* may be NULL */
    void *user;                /* passed to both */
    vsh_isa isa;               /* for tests; VSH_ERROR_ARGUMENT if this machine lacks it. Results do not
                                  depend on it */
    const char *reader;        /* program that parses files: VSH_READER, or one whose main calls
                                  vsh_reader_serve(), found as by execvp(). NULL: this process parses them, and a
                                  damaged file can crash it. Results do not depend on it */
    double reader_seconds; /* time that the reader may take for one file, > 0; else VSH_ERROR_LIMIT. 0: 60,
                              plus one for each MB of the file */
    int32_t confined;      /* 1: fail with VSH_ERROR_UNSUPPORTED if the system refuses one of the reader's
                              confinements; needs a reader. 0: warn, unless only Landlock is missing */
    int32_t allow_outside; /* 1: buffers and materials of a model may lie outside its folder. 0: such files
                              are VSH_ERROR_INPUT */
    uint64_t memory_held;  /* bytes of memory_limit that the caller holds and does not pass to the call */
    int32_t notes;         /* 1: `warning` receives notes too */
} vsh_run;

static inline vsh_run vsh_run_default(void) {
    vsh_run run = {sizeof(vsh_run), 0, 0, NULL, NULL, NULL, VSH_ISA_BEST, NULL, 0.0, 0, 0, 0, 0};
    return run;
}

/* --- hashes of files */

enum { VSH_DIGEST_TEXT = 65 }; /* bytes of a digest as text, with NUL */

/* Writes the SHA-256 (FIPS 180-4) of a file as 64 hexadecimal digits, as sha256sum prints it. Errors:
 * VSH_ERROR_ARGUMENT (path NULL or empty, run), VSH_ERROR_READ (no such file, no permission, no regular
 * file), VSH_ERROR_CANCELLED (stage "hash", 16 times a MB). */
VSH_API vsh_result vsh_file_digest(const char *path, const vsh_run *run, char digest[VSH_DIGEST_TEXT],
                                   vsh_error *error);

/* --- the confined reader of files from strangers (docs/security.md)
 *
 * A call with vsh_run.reader starts that program for each file and waits. The child confines all its threads
 * before it loads the libraries that parse, and before it opens the file:
 *
 * - Limits (VSH_CONFINED_LIMITS) of data, processor time and descriptors; no core dump, no new privileges;
 *   it ends with its parent. Data may be run->memory_limit, plus 68 MiB for the program (176 for images) and
 *   a stack for each core. Without a limit, it may be the machine's memory.
 * - Calls (VSH_CONFINED_CALLS): a seccomp filter allows reading files, memory and its own threads. It allows
 *   no sockets, programs, writing or signals. The parent asks the kernel whether every thread has the
 *   filter.
 * - Files (VSH_CONFINED_FILES): Landlock (Linux 5.13) allows the file, the folder of a model, and libraries.
 *   The memory and environment of other processes are closed. The child's environment keeps only variables
 *   of the dynamic linker, of locales and of sanitizers.
 *
 * If the system refuses one of them (an old kernel, a container), the others still hold. A warning says what
 * is missing, except for files, which many systems cannot confine. run->confined makes it an error.
 *
 * The child writes arrays into memory that the caller provided. When it has ended, the caller seals that
 * memory and checks sizes, counts, indices, finite values, transforms and strings before it uses them.
 *
 * - A crash is VSH_ERROR_READ ("PATH: damaged: the reader crashed (SIGSEGV)"). A file that takes too long or
 *   too much memory is VSH_ERROR_LIMIT.
 * - Cancelling kills the child at once. */

/* A reader's only argument. */
#define VSH_READER_ARGUMENT "--vdbshade-reader"

/* For vsh_run.reader: the program vdbshade-reader, which is installed in libexec and found from the library's
 * folder. It starts faster than a program linked with the library, which has to start twice if libraries
 * started threads before its main. */
#define VSH_READER "vdbshade-reader"

/* Confinements of a reader: bits. */
typedef enum vsh_confinement {
    VSH_CONFINED_LIMITS = 1,
    VSH_CONFINED_CALLS = 2,
    VSH_CONFINED_FILES = 4,
    VSH_CONFINED_ALL = 7
} vsh_confinement;

/* Call it first in the main of a program that is its own reader ("/proc/self/exe"), before any thread does
 * work. If argv[1] is VSH_READER_ARGUMENT, it confines the process for good, parses the file that the parent
 * asks for, and returns the exit code for main. Otherwise it returns -1. Every vdbshade of the same version
 * is a reader too. In a reader's environment VSH_IN_READER is set. There, calls with vsh_run.reader fail with
 * VSH_ERROR_ARGUMENT, so a main that forgets this call cannot start itself again and again. */
VSH_API int32_t vsh_reader_serve(int argc, char **argv);

/* Starts run->reader to see how it is confined here, and sets *confined to a sum of VSH_CONFINED_…. Errors:
 * VSH_ERROR_ARGUMENT (no reader given or found), VSH_ERROR_UNSUPPORTED (run->confined, and a confinement is
 * missing).
 */
VSH_API vsh_result vsh_reader_confinement(const vsh_run *run, uint32_t *confined, vsh_error *error);

VSH_END_C
