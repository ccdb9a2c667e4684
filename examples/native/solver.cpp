// A start for a native solver in C++17: level 1, the forces and the threshold of one grain, and of
// level 4 the pivot law: each grain by itself, on a bed of any shape, packing and sizes.
//
//   g++ -O2 -std=c++17 -o solver solver.cpp
//   ./solver CASE OUT
//
// Reads the directory of a scene and writes its answer, as docs/benchmark.md says. Add the other
// kinds in main(); it ends with 2 for those it does not know.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

// scene.json is one flat object of numbers and words
struct Scene {
    std::map<std::string, double> number;
    std::map<std::string, std::string> word;

    explicit Scene(const std::string& path) {
        std::ifstream file(path);
        std::stringstream content;
        content << file.rdbuf();
        const std::string text = content.str();
        const std::regex entry("\"(\\w+)\": (\"([^\"]*)\"|[-+.eE0-9]+)");
        for (std::sregex_iterator it(text.begin(), text.end(), entry), end; it != end; ++it) {
            if ((*it)[3].matched)
                word[(*it)[1]] = (*it)[3];
            else
                number[(*it)[1]] = std::stod((*it)[2]);
        }
    }
    double operator[](const std::string& name) const { return number.at(name); }
};

const double pi = std::acos(-1.0);

struct Forces {
    double drag, lift;
};

// The positive root x of ustar^2 = viscous x + (x/rough)^2: the stress is carried together
double bridge(double ustar, double viscous, double rough) {
    return 2 * ustar * ustar / (viscous + std::hypot(viscous, 2 * ustar / rough));
}

// Drag and lift on an exposed grain, N: Eq. 2 (low), Eq. 4 (high) and the law that bridges them
Forces forces(const Scene& s, double ustar) {
    const double d = s["d_m"], rho = s["rho_f_kg_m3"], nu = s["nu_m2_s"], r = s["z0_m"] / d;
    const std::string& law = s.word.at("force_law");
    if (law != "low" && law != "high" && law != "bridged")
        throw std::runtime_error("this solver has no force law " + law);
    const double a = nu / (d / 2 + s["z0_m"]);
    const double c = 2.5 * ((1 + r) * std::log1p(1 / r) - 1), g = 2.5 * std::log1p(1 / r) / d;
    const double speed = law == "low" ? ustar * ustar / a : law == "high" ? ustar * c : bridge(ustar, a, c);
    const double shear = law == "low" ? ustar * ustar / nu : law == "high" ? ustar * g : bridge(ustar, nu, g);
    const double finite = law == "low" ? 1 : 1 + 0.15 * std::pow(speed * d / nu, 0.687);
    return {3 * pi * rho * nu * d * speed * finite,
            s["alpha_s"] * rho * std::sqrt(nu * shear) * d * d * speed};
}

// The u* at which the moment of the forces about the neighbour reaches that of the weight, m/s
double threshold(const Scene& s, double slope_deg) {
    const double alpha = slope_deg * pi / 180, beta = s["beta_deg"] * pi / 180;
    const double goal = s["weight_n"] * std::cos(alpha - beta);
    double low = 1e-6, high = 1e3;
    for (int i = 0; i < 200; ++i) {
        const double middle = std::sqrt(low * high);
        const Forces f = forces(s, middle);
        (f.drag * std::sin(beta) + f.lift * std::cos(beta) < goal ? low : high) = middle;
    }
    return std::sqrt(low * high);
}

double closed_form(const Scene& s, const std::string& quantity, const std::string& at) {
    if (quantity == "drag_n") return forces(s, std::stod(at)).drag;
    if (quantity == "lift_n") return forces(s, std::stod(at)).lift;
    const double ustar = threshold(s, s["alpha_deg"]);
    if (quantity == "ustar_m_s") return ustar;
    if (quantity == "reynolds") return ustar * s["d_m"] / s["nu_m2_s"];
    const double excess = (s["rho_sol_kg_m3"] - s["rho_f_kg_m3"]) * s["g_m_s2"] * s["d_m"];
    return s["rho_f_kg_m3"] * ustar * ustar / excess;  // shields
}

using Row = std::map<std::string, std::string>;

std::vector<std::string> cells(const std::string& line) {
    std::stringstream stream(line);
    std::vector<std::string> found;
    for (std::string cell; std::getline(stream, cell, ',');) found.push_back(cell);
    return found;
}

// The rows of a table by the names of its columns
std::vector<Row> table(const std::string& path) {
    std::ifstream file(path);
    std::string line;
    std::getline(file, line);
    const auto names = cells(line);
    std::vector<Row> rows;
    while (std::getline(file, line)) {
        const auto values = cells(line);
        Row row;
        // the last cells of a fixed grain are empty
        for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = i < values.size() ? values[i] : "";
        rows.push_back(row);
    }
    return rows;
}

double number(const Row& row, const std::string& name) { return std::stod(row.at(name)); }

struct Disc {
    double x, z, radius;
};

// Level 4 by pivots: the load step in which each counted grain goes, 0 for never
class Pile {
public:
    Pile(const Scene& scene, const std::string& folder) : s(scene) {
        for (const Row& row : table(folder + "/load_steps.csv"))
            flow.push_back(number(row, "ustar0_m_s"));
        const auto grains = table(folder + "/grains.csv");
        std::map<std::string, std::vector<Row>> forces;
        for (const Row& row : table(folder + "/forces.csv"))  // there are none of equal grains
            forces[row.at("id")].push_back(row);
        for (const Row& row : grains)
            discs.push_back({number(row, "x_m"), number(row, "z_m"), number(row, "d_m") / 2});
        for (const Row& row : grains) {
            if (row.at("kind") != "counted") continue;
            const double ratio = number(row, "ustar_over_ustar0");
            stress.push_back(ratio * ratio);
            goes_in.push_back(forces.empty() ? on_lattice(row, ratio)
                                             : on_own_pocket(row, ratio, forces[row.at("id")]));
        }
    }

    double answer(const std::string& quantity, const std::string& at) const {
        if (quantity == "carried_off") return 0;
        if (quantity == "moved") return moved(std::stoi(at));
        if (quantity == "not_moved") return double(goes_in.size()) - moved(std::stoi(at));
        std::size_t step = 1;
        const double needed = std::max(std::ceil(std::stod(at) * goes_in.size() - 1e-9), 1.0);
        while (step + 1 < flow.size() && moved(step) < needed) ++step;
        const double ustar0 = std::sqrt(flow[step - 1] * flow[step]);
        if (quantity == "ustar0_m_s") return ustar0;
        double sum = 0;
        for (std::size_t i = 0; i < goes_in.size(); ++i)
            if (0 < goes_in[i] && goes_in[i] <= step) sum += stress[i];
        const double excess = (s["rho_sol_kg_m3"] - s["rho_f_kg_m3"]) * s["g_m_s2"] * s["d_m"];
        return s["rho_f_kg_m3"] * ustar0 * ustar0 * sum / std::max(moved(step), 1.0) / excess;
    }

private:
    const Scene& s;
    std::vector<double> flow, stress;
    std::vector<Disc> discs;
    std::vector<std::size_t> goes_in;

    double moved(std::size_t step) const {
        return std::count_if(goes_in.begin(), goes_in.end(),
                             [=](std::size_t own) { return 0 < own && own <= step; });
    }

    // flow that runs back pushes the grain the other way, on a slope of the other sign
    std::size_t on_lattice(const Row& row, double ratio) const {
        if (ratio == 0) return 0;
        const double alone = threshold(s, std::copysign(1.0, ratio) * number(row, "slope_deg"));
        for (std::size_t step = 1; step < flow.size(); ++step)
            if (alone <= std::abs(ratio) * flow[step]) return step;
        return 0;
    }

    // it goes when the force, with its weight, turns it over its foremost contact
    std::size_t on_own_pocket(const Row& row, double ratio, const std::vector<Row>& force) const {
        const double side = std::copysign(1.0, ratio);
        const Disc& here = discs.at(std::stoul(row.at("id")) - 1);
        const double weight = s["weight_n"] * std::pow(2 * here.radius / s["d_m"], 3);
        double lean = -pi;
        for (const Disc& other : discs) {
            const double dx = other.x - here.x, dz = other.z - here.z, apart = std::hypot(dx, dz);
            if (0 < apart && apart < 1.001 * (here.radius + other.radius))
                lean = std::max(lean, std::atan2(side * dx, -dz));
        }
        for (std::size_t step = 1; step < force.size(); ++step) {
            const double fx = side * number(force[step], "fx_n"), fz = number(force[step], "fz_n");
            if (fx * std::cos(lean) + (fz - weight) * std::sin(lean) >= 0) return step;
        }
        return 0;
    }
};

int main(int count, char** arguments) {
    if (count != 3) {
        std::cerr << "usage: solver CASE OUT\n";
        return 2;
    }
    const std::string scene_directory = arguments[1];
    const Scene scene(scene_directory + "/scene.json");
    const std::string kind = scene.word.at("kind");
    if (kind != "closed-form" && kind != "pile") {
        std::cerr << "this solver does not know the kind " << kind << "\n";
        return 2;
    }
    std::optional<Pile> pile;
    if (kind == "pile") pile.emplace(scene, scene_directory);
    std::ifstream ask(scene_directory + "/ask.csv");
    std::ofstream out(arguments[2]);
    out.precision(17);
    out << "quantity,at,value\n";
    std::string line;
    std::getline(ask, line);  // the head
    while (std::getline(ask, line)) {
        const auto comma = line.find(',');
        const std::string quantity = line.substr(0, comma), at = line.substr(comma + 1);
        const double value = pile ? pile->answer(quantity, at) : closed_form(scene, quantity, at);
        out << quantity << ',' << at << ',' << value << '\n';
    }
    return 0;
}
