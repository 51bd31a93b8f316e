// ITK's signed Maurer distance and connected components of a raw 8-bit mask, one thread.
#include <itkConnectedComponentImageFilter.h>
#include <itkImage.h>
#include <itkImportImageFilter.h>
#include <itkMultiThreaderBase.h>
#include <itkSignedMaurerDistanceMapImageFilter.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <vector>

namespace {

template <class Work>
double seconds(const Work& work)
{
    const std::clock_t start = std::clock();
    work();
    return double(std::clock() - start) / CLOCKS_PER_SEC;
}

}  // namespace

/// itk_kernels FILE.raw NX NY NZ: prints `name seconds` lines
int main(int argc, char** argv)
{
    if (argc != 5) return 2;
    using Mask = itk::Image<unsigned char, 3>;
    itk::MultiThreaderBase::SetGlobalMaximumNumberOfThreads(1);
    itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(1);
    Mask::SizeType size;
    std::size_t count = 1;
    for (unsigned a = 0; a < 3; ++a) count *= size[a] = std::size_t(std::atol(argv[2 + a]));
    std::vector<unsigned char> voxels(count);
    std::ifstream(argv[1], std::ios::binary).read(reinterpret_cast<char*>(voxels.data()), std::streamsize(count));
    auto import = itk::ImportImageFilter<unsigned char, 3>::New();
    import->SetRegion(Mask::RegionType(size));
    import->SetImportPointer(voxels.data(), count, false);
    import->Update();
    {
        auto distance = itk::SignedMaurerDistanceMapImageFilter<Mask, itk::Image<float, 3>>::New();
        distance->SetInput(import->GetOutput());
        distance->SetSquaredDistance(false);
        distance->SetUseImageSpacing(true);
        std::printf("signed_distance %.3f\n", seconds([&] { distance->Update(); }));
    }
    auto labels = itk::ConnectedComponentImageFilter<Mask, itk::Image<unsigned, 3>>::New();
    labels->SetInput(import->GetOutput());
    labels->SetFullyConnected(true);
    std::printf("labels %.3f\n", seconds([&] { labels->Update(); }));
    std::printf("components %zu\n", std::size_t(labels->GetObjectCount()));
}
