/*---------------------------------------------------------------------------*\
    periFoam: peridynamic structures in OpenFOAM flows

License
    GPL-3.0-or-later, see LICENSE.

\*---------------------------------------------------------------------------*/

#include "periFoamDecomp.H"
#include "addToRunTimeSelectionTable.H"
#include "indexedOctree.H"
#include "IOdictionary.H"
#include "OSspecific.H"
#include "Time.H"
#include "treeDataCell.H"
#include "treeDataPoint.H"

// * * * * * * * * * * * * * * Static Data Members * * * * * * * * * * * * * //

namespace Foam
{
    defineTypeNameAndDebug(periFoamDecomp, 0);
    addToRunTimeSelectionTable(decompositionMethod, periFoamDecomp, dictionary);
    addToRunTimeSelectionTable
    (
        decompositionMethod,
        periFoamDecomp,
        dictionaryRegion
    );
}


// * * * * * * * * * * * * * * * Local Functions * * * * * * * * * * * * * * //

namespace
{

using namespace Foam;

const char* const dictName = "decomposeParDict";

//- The cell that a place is in, or the nearest one
class cellFinder
{
    const polyMesh& mesh_;
    indexedOctree<treeDataPoint> centres_;

    static treeBoundBox boxOf(const polyMesh& mesh)
    {
        Random random(1);
        return treeBoundBox(mesh.points()).extend(random, 1e-4);
    }


public:

    explicit cellFinder(const polyMesh& mesh)
    :
        mesh_(mesh),
        centres_(treeDataPoint(mesh.cellCentres()), boxOf(mesh), 12, 10, 3)
    {}

    label at(point X) const
    {
        for (direction d = 0; d < 3; ++d)
        {
            if (mesh_.geometricD()[d] < 0)
            {
                X[d] = mesh_.bounds().midpoint()[d];
            }
        }
        const label nearest = centres_.findNearest(X, sqr(GREAT)).index();
        if (mesh_.pointInCell(X, nearest, polyMesh::FACE_PLANES))
        {
            return nearest;
        }
        const label inside =
            mesh_.bounds().contains(X) ? mesh_.cellTree().findInside(X) : -1;
        return inside < 0 ? nearest : inside;
    }
};

//- A mesh of the case, as it stands or read
class caseMesh
{
    autoPtr<polyMesh> read_;
    const polyMesh* mesh_;

public:

    caseMesh(const Time& time, const word& name)
    :
        mesh_(time.findObject<polyMesh>(name))
    {
        if (!mesh_)
        {
            read_.reset
            (
                new polyMesh
                (
                    IOobject(name, time.timeName(), time, IOobject::MUST_READ)
                )
            );
            mesh_ = &read_();
        }
    }

    const polyMesh& operator()() const
    {
        return *mesh_;
    }
};

//- The region that the bodies are in: what the function object says
word fluidName(const Time& time)
{
    const dictionary* functions = time.controlDict().findDict("functions");
    if (functions)
    {
        for (const entry& e : *functions)
        {
            if
            (
                e.isDict()
             && e.dict().lookupOrDefault<word>("type", "") == "peridynamics"
            )
            {
                return e.dict().lookupOrDefault<word>
                (
                    "region", polyMesh::defaultRegion
                );
            }
        }
    }
    return polyMesh::defaultRegion;
}

bool hasMesh(const Time& time, const word& name)
{
    const fileName region
    (
        name == polyMesh::defaultRegion ? fileName() : fileName(name)
    );
    return isFile
    (
        time.path()/time.constant()/region/polyMesh::meshSubDir/"owner"
    );
}

//- Percent by which the largest of some sums is above their mean
scalar excess(const scalarField& sums)
{
    const scalar mean = average(sums);
    return mean > 0 ? 100*(max(sums)/mean - 1) : 0;
}

string percent(const scalar value)
{
    OStringStream os;
    os << std::round(10*value)/10 << " %";
    return os.str();
}

} // End anonymous namespace


// * * * * * * * * * * * * * Private Member Functions  * * * * * * * * * * * //

void Foam::periFoamDecomp::readCoeffs()
{
    using periFoam::range;
    const periFoam::checkedDictionary dict
    (
        findCoeffsDict(word(typeName) + "Coeffs", selectionType::NULL_DICT)
    );
    pointCost_ = dict.numberOr(1, "pointCost", range::atLeast(0), dimless);
    imbalance_ = dict.numberOr
    (
        0.03, "imbalance", range::between(0, 1, false, true), dimless
    );
    dict.finish();
}


void Foam::periFoamDecomp::checkUse() const
{
    if (Pstream::parRun())
    {
        FatalIOErrorInFunction(decompDict_)
            << "the method " << type() << " in parallel; allowed: decomposePar"
            << " in serial" << exit(FatalIOError);
    }
    if (decompDict_.found("weightField"))
    {
        periFoam::checkedDictionary(decompDict_).refuse
        (
            "weightField",
            "allowed: none with the method " + word(type())
          + ", which weighs cells by the points in them"
        );
    }
}


Foam::scalar Foam::periFoamDecomp::tolerableLoad
(
    const scalar cells,
    const scalarField& load
) const
{
    const scalar whole = sum(load);
    if (whole <= 0)
    {
        return GREAT;
    }
    // However little the points cost, not far off: memory, and costs that are
    // not those that were measured. What one cell holds stays together
    const scalar most = max(imbalance_, 0.06);
    return
        1 + min(imbalance_*(cells + whole)/whole, most)
      + max(load)*nDomains_/whole;
}


Foam::labelList Foam::periFoamDecomp::share
(
    const polyMesh& mesh,
    const labelList& clusterOf,
    const scalarField& size,
    const scalarField& load
) const
{
    CompactListList<label> neighbours;
    calcCellCells(mesh, clusterOf, size.size(), true, neighbours);
    List<pd_local> first(size.size() + 1), neighbour(neighbours.m().size());
    forAll(first, i)
    {
        first[i] = neighbours.offsets()[i];
    }
    forAll(neighbour, i)
    {
        neighbour[i] = neighbours.m()[i];
    }

    // A limit that a single rank may keep is none
    const scalar loadLimit = tolerableLoad(sum(size), load);
    const label nCosts = loadLimit < nDomains_ ? 2 : 1;
    scalarField cost(nCosts*size.size());
    forAll(size, i)
    {
        cost[nCosts*i] = size[i];
        cost[nCosts*(i + 1) - 1] = nCosts == 2 ? load[i] : size[i];
    }
    const scalar tolerance[] = {1 + imbalance_, loadLimit};

    pd_graph graph{};
    graph.n = size.size();
    graph.first = first.cdata();
    graph.neighbour = neighbour.cdata();
    graph.n_costs = nCosts;
    graph.cost = cost.cdata();
    graph.tolerance = tolerance;
    List<int> part(size.size());
    const pd_status status =
        pd_partition_graph(&graph, nDomains_, part.data());
    if (status.code != PD_OK)
    {
        FatalIOErrorInFunction(decompDict_)
            << "the mesh " << mesh.name() << " cannot be decomposed: "
            << status.message << exit(FatalIOError);
    }
    labelList rank(size.size());
    forAll(rank, i)
    {
        rank[i] = part[i];
    }
    return rank;
}


Foam::labelList Foam::periFoamDecomp::decomposeFluid
(
    const polyMesh& fluid,
    const periFoam::scene& scene,
    const labelList& clusterOf,
    const scalarField& size
) const
{
    const periFoam::checkedDictionary top(scene.properties());
    const periFoam::checkedDictionary bodies(top.sub("bodies"));
    const wordList names(bodies.subNames());
    const cellFinder finder(fluid);

    scalarField load(size.size(), Zero);
    PtrList<periFoam::bodyCloud> clouds(names.size());
    labelListList clusters(names.size());
    forAll(names, b)
    {
        const periFoam::checkedDictionary dict(bodies.sub(names[b]));
        scene.checkMesh(names[b], dict);
        const caseMesh solid(scene.time(), names[b]);
        clouds.set(b, new periFoam::bodyCloud(names[b], dict, solid()));
        const scalarField costs(clouds[b].costs());
        clusters[b].resize(costs.size());
        forAll(costs, i)
        {
            const label celli = finder.at(solid().cellCentres()[i]);
            clusters[b][i] = clusterOf[celli];
            load[clusterOf[celli]] += pointCost_*costs[i];
        }
    }
    const labelList rank(share(fluid, clusterOf, size, load));
    tellCells(fluid, clusterOf, rank, size, load);
    forAll(names, b)
    {
        tellBody(clouds[b], labelUIndList(rank, clusters[b])());
    }
    return rank;
}


Foam::labelList Foam::periFoamDecomp::ranksOfFluid
(
    const polyMesh& fluid,
    const word& body
) const
{
    // The body's own dictionary, or one that serves all regions
    const Time& time = fluid.time();
    autoPtr<IOdictionary> own;
    if (decompDict_.name() == time.path()/time.system()/body/dictName)
    {
        own.reset
        (
            new IOdictionary
            (
                IOobject
                (
                    dictName,
                    time.system(),
                    fluid.dbDir(),
                    time,
                    IOobject::MUST_READ,
                    IOobject::NO_WRITE,
                    false
                )
            )
        );
    }
    const dictionary& dict = own.valid() ? own() : decompDict_;
    autoPtr<decompositionMethod> method
    (
        decompositionMethod::New(dict, fluid.name())
    );
    if (method().nDomains() != nDomains_)
    {
        periFoam::checkedDictionary(decompDict_).refuse
        (
            "numberOfSubdomains",
            "allowed: as for the fluid, " + Foam::name(method().nDomains())
        );
    }
    if (dict.found("weightField"))
    {
        periFoam::checkedDictionary(dict).refuse
        (
            "weightField",
            "allowed: none where a body follows the fluid by the method "
          + word(type())
        );
    }
    if (isA<periFoamDecomp>(method()))
    {
        refCast<periFoamDecomp>(method()).tells_ = false;
    }
    return method().decompose(fluid, scalarField());
}


Foam::labelList Foam::periFoamDecomp::decomposeBody
(
    const polyMesh& solid,
    const periFoam::scene& scene
) const
{
    const Time& time = scene.time();
    const periFoam::checkedDictionary top(scene.properties());
    const periFoam::checkedDictionary bodies(top.sub("bodies"));
    const periFoam::bodyCloud cloud
    (
        solid.name(), bodies.sub(solid.name()), solid
    );
    labelList rank(cloud.size());
    const word name(fluidName(time));
    if (hasMesh(time, name))
    {
        const caseMesh fluid(time, name);
        const labelList rankOfCell(ranksOfFluid(fluid(), solid.name()));
        const cellFinder finder(fluid());
        forAll(rank, i)
        {
            rank[i] = rankOfCell[finder.at(solid.cellCentres()[i])];
        }
    }
    else
    {
        rank = cloud.partition(nDomains_);
    }
    tellBody(cloud, rank);
    return rank;
}


Foam::labelList Foam::periFoamDecomp::ranksOf
(
    const polyMesh& mesh,
    const labelList& clusterOf,
    const scalarField& size
) const
{
    checkUse();
    const periFoam::scene scene(mesh.time());
    const periFoam::checkedDictionary top(scene.properties());
    const wordList bodies(top.sub("bodies").subNames());
    if (bodies.found(mesh.name()))
    {
        // A cluster goes where its first cell goes
        const labelList rankOfCell(decomposeBody(mesh, scene));
        labelList rank(size.size());
        forAllReverse(rankOfCell, celli)
        {
            rank[clusterOf[celli]] = rankOfCell[celli];
        }
        return rank;
    }
    if (mesh.name() == fluidName(mesh.time()))
    {
        return decomposeFluid(mesh, scene, clusterOf, size);
    }
    const scalarField none(size.size(), Zero);
    const labelList rank(share(mesh, clusterOf, size, none));
    tellCells(mesh, clusterOf, rank, size, none);
    return rank;
}


void Foam::periFoamDecomp::tellCells
(
    const polyMesh& mesh,
    const labelUList& clusterOf,
    const labelUList& rank,
    const scalarField& size,
    const scalarField& load
) const
{
    if (!tells_)
    {
        return;
    }
    scalarField cells(nDomains_, Zero), loads(nDomains_, Zero);
    forAll(rank, i)
    {
        cells[rank[i]] += size[i];
        loads[rank[i]] += load[i];
    }
    Info<< type() << ": " << mesh.name() << ": " << clusterOf.size()
        << " cells, " << percent(excess(cells)).c_str()
        << " above the mean on the fullest rank";
    const scalar whole = sum(loads);
    if (whole > 0)
    {
        const scalar share = whole/(sum(cells) + whole);
        Info<< "; the points, " << percent(100*share).c_str()
            << " of the cost, " << percent(excess(loads)).c_str();
    }
    Info<< endl;
}


void Foam::periFoamDecomp::tellBody
(
    const periFoam::bodyCloud& cloud,
    const labelUList& rank
) const
{
    if (!tells_)
    {
        return;
    }
    const pd_partition_quality q = cloud.measure(nDomains_, rank);
    Info<< type() << ": " << cloud.name() << ": " << cloud.size()
        << " points, " << percent(100*(q.points - 1)).c_str()
        << " above the mean on the fullest rank, those that move "
        << percent(100*(q.moving - 1)).c_str() << ", bonds "
        << percent(100*(q.cost - 1)).c_str() << ", bonds cut "
        << percent(q.bonds ? 100.*q.cut/q.bonds : 0).c_str() << endl;
}


// * * * * * * * * * * * * * * * * Constructors  * * * * * * * * * * * * * * //

Foam::periFoamDecomp::periFoamDecomp(const dictionary& decompDict)
:
    decompositionMethod(decompDict),
    tells_(true)
{
    readCoeffs();
}


Foam::periFoamDecomp::periFoamDecomp
(
    const dictionary& decompDict,
    const word& regionName
)
:
    decompositionMethod(decompDict, regionName),
    tells_(true)
{
    readCoeffs();
}


// * * * * * * * * * * * * * * * Member Functions  * * * * * * * * * * * * * //

Foam::labelList Foam::periFoamDecomp::decompose
(
    const polyMesh& mesh,
    const pointField& points,
    const scalarField& pointWeights
) const
{
    return ranksOf
    (
        mesh, identity(mesh.nCells()), scalarField(mesh.nCells(), 1)
    );
}


Foam::labelList Foam::periFoamDecomp::decompose
(
    const polyMesh& mesh,
    const labelList& cellToRegion,
    const pointField& regionPoints,
    const scalarField& regionWeights
) const
{
    const labelList rank(ranksOf(mesh, cellToRegion, regionWeights));
    return labelUIndList(rank, cellToRegion)();
}


Foam::labelList Foam::periFoamDecomp::decompose
(
    const labelListList& globalCellCells,
    const pointField& cc,
    const scalarField& cWeights
) const
{
    FatalIOErrorInFunction(decompDict_)
        << "the method " << type() << " needs a mesh; allowed here: another"
        << " method" << exit(FatalIOError);
    return labelList();
}


// ************************************************************************* //
