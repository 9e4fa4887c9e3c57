"""What a run wrote, read by VTK's OpenFOAM reader without ParaView's window."""
import pathlib

from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet
from vtkmodules.vtkIOParallel import vtkPOpenFOAMReader

from writtenFields import at, write_times

DECOMPOSED, RECONSTRUCTED = 0, 1  # vtkPOpenFOAMReader's case types


class Run:
    """The points of a run's bodies. Of a run on ranks that was not reconstructed, those that the
    ranks wrote."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        # Without a fluid reconstructPar leaves the positions out
        whole = any(self.folder.glob("[0-9]*/**/lagrangian/*/positions"))
        self.part = self.folder if whole else self.folder / "processor0"
        self.folders = write_times(self.part)
        self.reader = vtkPOpenFOAMReader()
        self.reader.SetFileName(str(self.folder / "case.foam"))
        self.reader.SetCaseType(RECONSTRUCTED if whole else DECOMPOSED)
        self.reader.SkipZeroTimeOff()
        self.reader.UpdateInformation()
        for k in range(self.reader.GetNumberOfPatchArrays()):
            name = self.reader.GetPatchArrayName(k)
            # Without the mesh the reader gives points at the first time only
            wanted = "lagrangian/" in name or name == "internalMesh"
            self.reader.SetPatchArrayStatus(name, wanted)
        self.reader.DisableAllCellArrays()
        self.reader.EnableAllLagrangianArrays()
        self.times = vtk_to_numpy(self.reader.GetTimeValues()).tolist()

    def folder_at(self, time):
        """<time>, of the run or of its first rank."""
        return at(self.folders, time)

    def points(self, time):
        """{body: (places [n, 3], {field: values})}"""
        self.reader.UpdateInformation()
        self.reader.UpdateTimeStep(time)
        found = {}
        collect(self.reader.GetOutput(), found, False)
        return found


def collect(block, found, cloud):
    for k in range(block.GetNumberOfBlocks()):
        inner, name = block.GetBlock(k), block.GetMetaData(k).Get(vtkCompositeDataSet.NAME())
        if inner is None:
            continue
        if inner.IsA("vtkMultiBlockDataSet"):
            collect(inner, found, name == "lagrangian")
        elif cloud and inner.GetNumberOfPoints():
            data = inner.GetPointData()
            found[name] = (vtk_to_numpy(inner.GetPoints().GetData()), {
                data.GetArrayName(i): vtk_to_numpy(data.GetArray(i))
                for i in range(data.GetNumberOfArrays())})
