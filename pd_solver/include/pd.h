/*
 * pd.h - the public interface of libpd, the peridynamics library of periFoam.
 *
 * Units: SI or any other consistent set; the comments give SI. In two dimensions
 * volumes are areas (m2) and a body is in plane strain or plane stress.
 *
 * Arrays of points: owned points come first, ghosts (copies of points that other ranks
 * own) after them. Vectors and tensors are interleaved: v[p*d + a], F[(p*d + a)*d + b]
 * with d = 2 or 3. Points are renumbered when a body is created; pd_body_view.id gives
 * the caller's number of each.
 *
 * Collective: called by all ranks of the body's communicator; returns the same status on
 * all of them, that of the lowest rank that failed. A rank may own no points.
 *
 * Errors: a function that can fail returns a pd_status. Nothing here prints or exits.
 * No function produces a NaN from finite input.
 *
 * Sources, keys as in docs/references.bib: [kim2023], [silling2007], [han2025].
 *
 * SPDX-License-Identifier: GPL-3.0-or-later
 */
#ifndef PD_H
#define PD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <mpi.h>

#ifdef __cplusplus
extern "C" {
#endif

#define PD_API __attribute__((visibility("default")))

typedef int32_t pd_local;  /* index of a point on this rank */
typedef int64_t pd_global; /* number of a point among all ranks */

/* ---- status ---- */

typedef enum {
    PD_OK = 0,
    PD_BAD_ARGUMENT, /* a value outside its bounds; the message holds both */
    PD_NO_MEMORY,
    PD_BAD_FAMILY, /* a point whose family does not span space at the start */
    PD_NOT_FINITE, /* a position or a force is NaN or infinite */
    PD_INVERTED,   /* J <= PD_SMALLEST_J in a body without damage */
    PD_FILE_ERROR  /* the message names the file and what is wrong with it */
} pd_code;

typedef struct {
    pd_code code;
    pd_global point;   /* caller's number of the point concerned, or -1 */
    char message[256]; /* holds the value and the bound; empty when code is PD_OK */
} pd_status;

/* ---- parameters ---- */

/* One number that a material or a formulation is made of, as a dictionary key. */
typedef struct {
    const char *key;     /* "G" */
    const char *unit;    /* SI, "Pa" */
    double above, below; /* allowed: above < value < below, unless ... */
    bool includes_above; /* ... above itself is allowed too */
    const char *meaning;
    enum { PD_NUMBER = 0, PD_INTEGER, PD_FLAG } kind; /* a flag is 0 or 1 */
    bool optional;
    double standard; /* what it is when absent, if optional */
} pd_parameter;

#define PD_MAX_PARAMETERS 8

/* ---- materials ---- */

/* What two dimensions mean. Without effect in one and three. */
typedef enum { PD_PLANE_STRAIN = 0, PD_PLANE_STRESS, PD_PLANES } pd_plane;

/* A symmetric tensor in a material's history: 11 22 33 12 23 13. */
#define PD_SYMMETRIC 6

/*
 * A material has a stress (hyperelastic), an update (rate form), both, or neither: then
 * it only gives moduli, for formulations that need no more.
 */
typedef struct {
    const char *name;   /* word in dictionaries */
    const char *source; /* where the equations stand */
    int n_parameters;
    const pd_parameter *parameters; /* [n_parameters] */

    /* Bulk and shear modulus at rest (Pa), those of space; plane counts in d = 2. */
    void (*moduli)(const double *parameters, int d, pd_plane plane, double *bulk,
                   double *shear);

    /* First Piola-Kirchhoff stress P[d][d][n] (Pa) from F[d][d][n] (-) and J[n] = det F,
     * J > 0 required: points last, so that loops over them become vector instructions.
     * [PD_PLANE_STRAIN] serves d = 3 too, and has F33 = 1 in d = 2; [PD_PLANE_STRESS] is
     * for d = 2 alone: P33 = 0, J that of the plane. NULL: none. */
    void (*stress[PD_PLANES])(const double *parameters, int d, size_t n, const double *F,
                              const double *J, double *P);

    /* Strain energy density Psi (J/m3) from F[d][d]; as stress. */
    double (*energy[PD_PLANES])(const double *parameters, int d, const double *F,
                                double J);

    /* What the two dimensions of F[2][2] do across them: F33 > 0 (-) in plane stress, and
     * Cauchy stress sigma33 (Pa) in plane strain. NULL where stress of that plane is. */
    double (*thickness)(const double *parameters, const double *F, double J);
    double (*out_of_plane)(const double *parameters, const double *F, double J);

    /* Advance Cauchy stress sigma[n][PD_SYMMETRIC] (Pa) and equivalent plastic strain
     * plastic[n] (-; NULL when the material has none) over a step, from the gradient
     * G[n][d][d] (-) of the displacement in the step with respect to the positions at its
     * middle. d = 2, 3; planes as in stress, plane stress keeps sigma33 = 0. NULL: none.
     */
    void (*update[PD_PLANES])(const double *parameters, int d, size_t n, const double *G,
                              double *sigma, double *plastic);
    bool is_plastic; /* update uses plastic */
} pd_material;

/* Null-terminated table of all materials. */
PD_API extern const pd_material *const pd_materials[];

/* The material of that name, or NULL. */
PD_API const pd_material *pd_material_find(const char *name);

/* Modulus of longitudinal waves at rest, rho c^2 (Pa). */
PD_API double pd_longitudinal_modulus(const pd_material *material,
                                      const double *parameters, int d, pd_plane plane);

/* kappa_stab from G and nu_stab, [kim2023] eq. 45 (Pa). */
PD_API double pd_kappa_stab(double G, double nu_stab);

/* ---- formulations ---- */

typedef struct pd_body pd_body;

/* Numbers that a formulation keeps from step to step, for checkpoints. */
typedef struct {
    const char *name, *unit, *description;
    enum { PD_OF_POINTS = 0, PD_OF_PAIRS } of;
    int width;
    pd_local n;     /* of points: those in [0, n) have values */
    bool may_lack;  /* a file may be without it: then it is as in a new body */
    double *values; /* [n][width]; of pairs: [pairs][width], the bonds of moving points to
                       larger indices and those of held points to moving ghosts, point by
                       point */
} pd_kept;

#define PD_MAX_KEPT 8

/* Criteria by which bonds can break; bits. */
enum { PD_BY_STRETCH = 1, PD_BY_STRESS = 2, PD_BY_PLASTIC_STRAIN = 4 };

typedef struct {
    const char *name;   /* word in dictionaries */
    const char *source; /* where the equations stand */
    bool corresponds;   /* the material's P(F) with an F that is exact for affine maps */
    int least_dimension;
    bool has_lattice_path; /* points of a lattice need no stored families */
    int criteria;          /* bits: how its bonds can break */
    int n_parameters;
    const pd_parameter *parameters; /* [n_parameters] */

    /* Does it work with this material, in this dimension and plane? */
    bool (*accepts)(const pd_material *material, int d, pd_plane plane);

    /* What the formulation derives once from a new body, and again when bonds have been
     * broken by hand. */
    pd_status (*prepare)(pd_body *body);

    /* Free what prepare allocated; NULL: nothing. */
    void (*release)(pd_body *body);

    /* Fill force (N/m3), F, J; break bonds if the body can be damaged. */
    void (*forces)(pd_body *body);

    /* Integrate the history over a step, see pd_body_advance; NULL: there is none. */
    void (*advance)(pd_body *body, double dt, double at);

    /* List what it keeps, kept[PD_MAX_KEPT], borrowed; returns how many. NULL: nothing
     * but the body's own arrays. */
    int (*keep)(pd_body *body, pd_kept *kept);

    /* Derive what the last forces left behind from what was kept, y, F, J and the broken
     * bonds; NULL: nothing. */
    void (*resume)(pd_body *body);

    /* Strain energy of the owned points (J); NULL: not defined. */
    double (*energy)(const pd_body *body);

    /* Cauchy stress sigma[n_owned][PD_SYMMETRIC] (Pa) and plastic[n_owned], the family's
     * mean of the equivalent plastic strain; either may be NULL. */
    void (*stress)(const pd_body *body, double *sigma, double *plastic);

    /* Fastest wave of the undeformed solid (m/s). */
    double (*wave_speed)(const pd_body *body);

    /* Upper bound of the square of the highest frequency that each moving point takes
     * part in, omega2[n_local] (1/s2; of moving points), by rows of the stiffness at
     * rest. */
    void (*frequency)(const pd_body *body, double *omega2);

    /* Horizons around the owned points from which ghosts are needed: 1, or 2 where F of
     * ghosts is computed rather than received. */
    int ghost_layers;
} pd_formulation;

/* Null-terminated table of all formulations. */
PD_API extern const pd_formulation *const pd_formulations[];

/* The formulation of that name, or NULL. */
PD_API const pd_formulation *pd_formulation_find(const char *name);

/* ---- bodies ---- */

/* A point whose K has 2^d or 3^d-fold det K / (tr K)^d below this carries no stress (1 is
 * isotropic, 0 is flat). Bonds of a lattice that still span space give >= 1e-2; bonds on
 * one line give round-off, <= 1e-12. */
#define PD_SINGULAR_SHAPE 1e-6

/* Volume ratio below which a point counts as inverted. */
#define PD_SMALLEST_J 1e-3

/* At most one criterion of damage is not 0; bonds cannot break when all are. */
typedef struct {
    int dimension;        /* d, 1 (bond alone), 2 or 3 */
    pd_plane plane;       /* in two dimensions */
    double horizon_ratio; /* m = horizon / point spacing, - */
    double density;       /* rho, kg/m3 */
    double damping;       /* eta in the force density -eta v, kg/(m3 s) */

    double critical_stretch; /* PD_BY_STRETCH: s_c = |xi + eta|/|xi| > 1, - */
    double energy_release;   /* PD_BY_STRETCH: G_c > 0, J/m2, which gives s_c */
    double critical_stress;  /* PD_BY_STRESS: von Mises stress of a bond, Pa */
    double failed_strain;    /* PD_BY_PLASTIC_STRAIN: where a bond has lost all, - */
    double sound_strain;     /* ... and up to where it has lost nothing, - */

    bool general; /* take the general path on lattices too, for comparisons */

    const pd_formulation *formulation;
    double formulation_parameters[PD_MAX_PARAMETERS]; /* in its table's order */
    const pd_material *material;
    double parameters[PD_MAX_PARAMETERS]; /* of the material, in its table's order */
} pd_body_options;

/* A rectangle corner + s edge1 + t edge2 with s, t in [0, 1]. In two dimensions it is the
 * segment corner + s edge1; edge2 is ignored. */
typedef struct {
    double corner[3], edge1[3], edge2[3]; /* m */
} pd_rectangle;

/* Borrowed pointers into a body, valid until it is destroyed. */
typedef struct {
    int dimension;
    pd_local n_moving; /* points [0, n_moving) move, the rest is held */
    pd_local n_active; /* points [0, n_active) keep a family; the rest is inside holds */
    pd_local n_owned;
    pd_local n_local;      /* owned + ghosts */
    const pd_global *id;   /* [n_local] caller's number */
    const pd_local *given; /* [n_owned] place among the points that this rank gave */
    const double *X;       /* [n_local][d] reference position, m */
    double *y;             /* [n_local][d] current position, m; the caller moves it */
    double *v;             /* [n_owned][d] velocity, m/s; the caller sets it */
    const double *volume;  /* [n_local] reference volume, m3 (m2) */
    const double *spacing; /* [n_local] volume^(1/d), m */
    const double *force;   /* [n_owned][d] force density, N/m3 of reference volume */
    const double *F;       /* [n_owned][d][d] non-local deformation gradient, - */
    const double *J;       /* [n_owned] det F, -; 1 where a point carries no stress */
} pd_body_view;

/* What a body amounts to. Sums over all ranks. */
typedef struct {
    double kinetic_energy;        /* J (J/m) */
    double mean_volume_change;    /* mean of J - 1 over moving points that bear stress */
    double sum_volume_change;     /* sum of (J - 1) V over the same, m3 (m2) */
    double smallest_J, largest_J; /* over the same */
    double largest_speed;         /* m/s */
    int64_t bonds, broken_bonds;  /* undirected */
    int64_t singular, inverted;   /* points that carry no stress, by cause */
} pd_summary;

/*
 * Build a body from n points: X[n][3] (m), volume[n] (m3; m2 in two dimensions), held[n]
 * (non-zero: the point never moves; NULL: none). Arrays are copied. The held part is
 * rigid and ends where its points' volumes end, half a spacing beyond the last of them:
 * moving points see there a displacement of zero. The first d components of X count.
 * Families are symmetric: points i and j are bonded when |xi| <= m (dX_i + dX_j)/2 with
 * dX = volume^(1/d). Points that stand on a cubic lattice but for 1e-4 of its step, with
 * volumes as equal, are put on it exactly where the formulation has a path for lattices.
 *
 * Collective over comm, which is duplicated; MPI_COMM_NULL is serial, MPI is then never
 * called. Each rank gives the points that it is to own, none of them twice; id[n] are
 * their numbers, 0 to the count of all points less one; NULL: rank after rank. Which
 * rank owns what changes no result beyond round-off: pd_partition makes a good choice.
 * Errors: PD_BAD_ARGUMENT, PD_NO_MEMORY, PD_BAD_FAMILY (the horizon does not connect the
 * point). *body is NULL on error. Followed by pd_body_destroy.
 */
PD_API pd_status pd_body_create(MPI_Comm comm, const pd_body_options *options, size_t n,
                                const double *X, const double *volume,
                                const unsigned char *held, const pd_global *id,
                                pd_body **body);

/* Free a body; NULL is allowed. Collective. */
PD_API void pd_body_destroy(pd_body *body);

/* Break the bonds that cross or touch a rectangle in the reference configuration; bonds
 * that lie in its plane stay. Before the first pd_body_forces. Collective, of the same
 * rectangle. Errors: PD_NO_MEMORY, PD_BAD_ARGUMENT (degenerate). */
PD_API pd_status pd_body_precrack(pd_body *body, const pd_rectangle *rectangle);

/* Let no bond of the points with protect[n] non-zero (as they were given at creation)
 * break. Before the first pd_body_forces. Collective. Errors: PD_NO_MEMORY. */
PD_API pd_status pd_body_protect(pd_body *body, const unsigned char *protect);

/* Set the dead load: force density b[n_owned][d] (N/m3), copied; NULL removes it. */
PD_API pd_status pd_body_load(pd_body *body, const double *b);

/* The mass per volume (kg/m3) that the integrators move from now on, where that is not
 * the density: a body that displaces a fluid whose inertia is accounted for elsewhere.
 * Errors: PD_BAD_ARGUMENT. */
PD_API pd_status pd_body_set_inertia(pd_body *body, double inertia);

/* What this rank and its neighbours tell each other. */
typedef struct {
    int neighbours;       /* ranks */
    pd_local ghosts;      /* points of theirs that stand here */
    pd_local sent;        /* places of our points in the messages to them */
    int64_t bytes, calls; /* that were sent, and exchanges, since the body was made */
} pd_traffic;

PD_API pd_traffic pd_body_traffic(const pd_body *body);

/* The arrays of a body. */
PD_API pd_body_view pd_body_fields(const pd_body *body);
PD_API const pd_body_options *pd_body_settings(const pd_body *body);

/* Force density at the current y and v, after breaking the bonds that exceed s_c there
 * ([kim2023] eqs 16-18, 25-29), plus dead load and damping. Collective.
 * Errors: PD_NOT_FINITE, PD_INVERTED (only when bonds cannot break; else the point
 * carries no stress and is counted). */
PD_API pd_status pd_body_forces(pd_body *body);

/*
 * Integrate the history of rate-form materials over a step dt (s) with the velocities v,
 * which are those at the middle of the step; y stands where the step is `at` of the way
 * through (0: its start, 0.5: its middle) and has not changed since pd_body_forces.
 * Nothing happens in bodies without a history. Collective. Errors: PD_NOT_FINITE.
 */
PD_API pd_status pd_body_advance(pd_body *body, double dt, double at);

/* Does the body have a history that pd_body_advance integrates? */
PD_API bool pd_body_has_history(const pd_body *body);

/* Cauchy stress sigma[n_owned][PD_SYMMETRIC] (Pa; 33 too in two dimensions) and
 * equivalent plastic strain plastic[n_owned] (-) of points; either may be NULL.
 * Collective. */
PD_API void pd_body_stress(pd_body *body, double *sigma, double *plastic);

/* Local damage phi in [0, 1] of owned points, damage[n_owned], [kim2023] eq. 18. */
PD_API void pd_body_damage(const pd_body *body, double *damage);

/* Label the pieces that intact bonds connect: piece[n_owned], the smallest number of a
 * piece's points, or of its held points if there are any. Held points deep inside a hold,
 * which keep no family, belong to no piece, -1. Returns how many there are; *holding (or
 * NULL): how many of them a hold holds. -1: no memory. Collective. */
PD_API pd_global pd_body_pieces(const pd_body *body, pd_global *piece,
                                pd_global *holding);

/* Sums and extremes; visits points and broken bonds. Collective. */
PD_API pd_summary pd_body_summary(const pd_body *body);

/* Strain energy, J (J/m); 0 where the formulation stores none. Visits every bond where
 * the formulation's energy is one of bonds. Collective. */
PD_API double pd_body_strain_energy(pd_body *body);

/* Fastest wave at rest (m/s). */
PD_API double pd_body_wave_speed(const pd_body *body);

/* s_c as a ratio |xi + eta|/|xi| of the bond from i to j (points of one family): given,
 * or from G_c, [han2025] eq. 18, with the pair's horizon; 0: bonds break otherwise. */
PD_API double pd_body_critical_stretch(const pd_body *body, pd_local i, pd_local j);

/* Bonds of point p: the count (0 for a point that keeps no family), and their other ends
 * neighbour[count], copied, of which at most `capacity`. For tests and post-processing.
 */
PD_API pd_local pd_body_family(const pd_body *body, pd_local p, pd_local capacity,
                               pd_local *neighbour);
PD_API bool pd_body_bond_intact(const pd_body *body, pd_local p, pd_local k);

/* ---- time ---- */

/* Points whose components of position are prescribed, instead of moving by force. */
typedef struct {
    size_t n;
    const pd_local *point;           /* [n] in [0, n_moving) */
    const unsigned char *components; /* [n] bits: 1 along the first axis, 2, 4 */
    const double *y;                 /* [n][d] where they are when the step ends, m */
} pd_prescribed;

typedef struct {
    const char *name;   /* word in dictionaries */
    const char *source; /* where the equations stand */

    /* One step, for pd_body_step alone. */
    pd_status (*step)(pd_body *body, double dt, const pd_prescribed *prescribed);
} pd_integrator;

/* Null-terminated table of all integrators. */
PD_API extern const pd_integrator *const pd_integrators[];

/* The integrator of that name, or NULL. */
PD_API const pd_integrator *pd_integrator_find(const char *name);

/*
 * Move the body by dt (s): positions, velocities, history and, after it, the forces at
 * the new positions, which pd_body_forces must have filled once before the first step. A
 * dead load is taken as it is set. prescribed may be NULL. Collective. Errors: as
 * pd_body_forces, with y and v of the failed step; PD_BAD_ARGUMENT (dt, a point out of
 * range), with nothing moved.
 */
PD_API pd_status pd_body_step(pd_body *body, const pd_integrator *integrator, double dt,
                              const pd_prescribed *prescribed);

/* Step up to which the integrators are stable at rest (s), from the formulation's bounds.
 * Damping does not limit it. HUGE_VAL when nothing moves, 0 without memory. Collective.
 */
PD_API double pd_body_stable_step(const pd_body *body);

/*
 * Relaxation towards the static answer: quasi-Newton iterations, [nocedal1980], with a
 * multilevel fictitious mass where dynamic relaxation, [kilic2010], has a diagonal one;
 * docs/relaxation.md. y moves; v is set to zero.
 */
typedef struct pd_relaxation pd_relaxation;

/* Borrow the body for relaxing; nothing else moves it meanwhile. Loads may change between
 * iterations. Followed by pd_relaxation_destroy. Errors: PD_NO_MEMORY, PD_BAD_ARGUMENT
 * (the body has a history). */
PD_API pd_status pd_relaxation_create(pd_body *body, pd_relaxation **relaxation);
PD_API void pd_relaxation_destroy(pd_relaxation *relaxation);

/* One iteration, with the forces at the new positions. Prescribed components are at
 * prescribed->y after it; which ones they are may change. *residual: the norm of the
 * unbalanced forces over that of the loads, reactions included (-); 0 where they are
 * round-off. Errors: as pd_body_step, after shorter steps have failed too. */
PD_API pd_status pd_relaxation_step(pd_relaxation *relaxation,
                                    const pd_prescribed *prescribed, double *residual);

/* ---- partition ---- */

/* Points to be shared out among ranks. All arrays borrowed. */
typedef struct {
    int dimension;        /* d, 1, 2 or 3 */
    double horizon_ratio; /* as in pd_body_options */
    size_t n;
    const double *X;           /* [n][3] m; the first d components count */
    const double *volume;      /* [n] m3; m2 in two dimensions */
    const unsigned char *held; /* [n]; NULL: none. A bond of two of them costs nothing */
    const double *weight;      /* [n] cost of a point's bond, >= 0; NULL: 1 for all */
} pd_cloud;

/* What a partition is like. */
typedef struct {
    size_t fewest; /* points of the emptiest part */
    /* Points, points that are not held, and cost of the fullest part, each over its mean
     * (-); 1 where there are none. */
    double points, moving, cost;
    int64_t bonds, cut; /* undirected; those between two parts */
} pd_partition_quality;

/* pd_partition keeps the cost of every part below this many means, but for the cost of
 * one point, or of one cluster of points, see there. */
#define PD_PARTITION_TOLERANCE 1.03

/*
 * Share n points out among parts: part[n] in [0, parts). Costs (pd_partition_costs) are
 * balanced, few bonds are cut; no part is empty while n >= parts. METIS, [karypis1998],
 * on the graph of the bonds; large clouds by clusters of up to 2^d, 3^d, ... points, of
 * which every part has some hundreds. The same input gives the same answer. Not
 * collective: every rank that wants the answer passes all points. Errors:
 * PD_BAD_ARGUMENT, PD_NO_MEMORY.
 */
PD_API pd_status pd_partition(const pd_cloud *cloud, int parts, int *part);

/* Cost of points, cost[n] (-): their bonds times their weight, at least 1. Errors: as
 * pd_partition. */
PD_API pd_status pd_partition_costs(const pd_cloud *cloud, double *cost);

/* How good a partition is, whoever made it. Errors: as pd_partition. */
PD_API pd_status pd_partition_measure(const pd_cloud *cloud, int parts, const int *part,
                                      pd_partition_quality *quality);

/* A graph with several costs a vertex, each to be balanced by itself. */
typedef struct {
    pd_local n;
    const pd_local *first;     /* [n + 1] into neighbour */
    const pd_local *neighbour; /* [first[n]] symmetric, without a vertex itself */
    int n_costs;
    const double *cost;      /* [n][n_costs] >= 0 */
    const double *tolerance; /* [n_costs] > 1: largest cost of a part over the mean */
} pd_graph;

/* Share the vertices out so that few edges are cut; as pd_partition. Where costs cannot
 * be had within the tolerances the answer is near them. */
PD_API pd_status pd_partition_graph(const pd_graph *graph, int parts, int *part);

/* ---- files ---- */

/* A number or word of the caller's that is kept beside a body's state. */
typedef struct {
    char name[48];
    enum { PD_NOTE_NUMBER = 0, PD_NOTE_INTEGER, PD_NOTE_TEXT } kind;
    double number;
    int64_t integer;
    char text[128];
} pd_note;

#define PD_MAX_NOTES 64

/*
 * Save the state of a body after pd_body_forces or a step, with notes[n_notes], in one
 * HDF5 file for all ranks, docs/files.md. Rows are in the order of the caller's numbers,
 * whoever owns the points. An earlier file of that name stays until the new one is whole
 * and on the disk. Collective. Errors: PD_FILE_ERROR, PD_NO_MEMORY, PD_BAD_ARGUMENT
 * (notes: a name twice, or more than PD_MAX_NOTES).
 */
PD_API pd_status pd_checkpoint_save(pd_body *body, const char *path, size_t n_notes,
                                    const pd_note *notes);

/*
 * Continue from a file: into a body that is as the saved one was when it was new, from
 * the same points, held parts, formulation and material, with the same pre-cracks and
 * protected points. Damping and criteria of damage may differ; the dead load is the
 * caller's to set. Fills in the notes named in notes[n_notes], of the given kind. On as
 * many ranks as wrote the file, or on others. With the same ranks, options, library and
 * machine all that follows is as if the run had not been interrupted, to the last bit.
 * Collective. Errors: PD_FILE_ERROR (no such file, damaged, of a newer version, of
 * another body: the message names the value of both, or the point), PD_NO_MEMORY; the
 * body must be destroyed then.
 */
PD_API pd_status pd_checkpoint_load(pd_body *body, const char *path, size_t n_notes,
                                    pd_note *notes);

/* What a checkpoint says of itself. */
typedef struct {
    int version; /* of the layout */
    int dimension;
    pd_global points;
    int64_t broken_bonds; /* undirected */
    int64_t size;         /* bytes */
    char formulation[48], material[48];
    size_t n_notes;
    pd_note notes[PD_MAX_NOTES];
} pd_checkpoint_facts;

/* Is the file whole and readable? Reads all of it. No MPI. Errors: as
 * pd_checkpoint_load's of files. */
PD_API pd_status pd_checkpoint_check(const char *path, pd_checkpoint_facts *facts);

/* A field of points, for pictures. */
typedef struct {
    const char *name, *unit, *description;
    int width;            /* 1, 3 (a vector) or 6: PD_SYMMETRIC */
    const double *values; /* [n_owned][width] */
} pd_field;

/* What is written of a body. */
typedef struct {
    double time;            /* s */
    size_t n_own;           /* fields of the body's own ... */
    const char *const *own; /* [n_own] ... by name, from pd_field_names */
    size_t n_fields;        /* the caller's own */
    const pd_field *fields; /* [n_fields] */
    int axes[3];            /* which axis of the picture each of the body's is; all 0:
                             * 0 1 2 */
    double origin[3];       /* added to positions, m: where a plane stands in space */
    bool single;            /* numbers of 4 bytes */
} pd_picture;

/* Null-terminated names of the fields that a body has: displacement, velocity, ... */
PD_API extern const char *const pd_field_names[];

/*
 * Write the points for ParaView: `<folder>/<name>_<time>.h5` with the current positions
 * and the fields, rows in the order of the caller's numbers, and `<folder>/<name>.xdmf`,
 * which lists all times whose files are there, for ParaView to open; later times than
 * this one, of a run that was continued from before them, are taken off the list. Vectors
 * and positions have three components. Collective. Errors: PD_FILE_ERROR, PD_NO_MEMORY,
 * PD_BAD_ARGUMENT (an unknown field, a width, a name with a slash, a time that is not
 * finite).
 */
PD_API pd_status pd_body_write_picture(pd_body *body, const char *folder,
                                       const char *name, const pd_picture *picture);

/* ---- the pieces of theory that stand alone ---- */

/* Influence function omega(r), r = 2 |xi| / horizon, [kim2023] eq. 30. */
PD_API double pd_influence(double r, int dimension);

/* Share of a neighbour's volume inside the horizon, [kim2023] eq. 24: lengths in m. */
PD_API double pd_volume_fraction(double length, double horizon, double spacing);

#ifdef __cplusplus
}
#endif
#endif
