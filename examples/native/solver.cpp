// A start for a native solver in C++17: level 1, the forces and the threshold of one grain.
//
//   g++ -O2 -std=c++17 -o solver solver.cpp
//   ./solver CASE OUT
//
// Reads the directory of a scene and writes its answer, as docs/benchmark.md says. Add the other
// kinds in main(); it ends with 2 for those it does not know.

#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string>

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
double threshold(const Scene& s) {
    const double alpha = s["alpha_deg"] * pi / 180, beta = s["beta_deg"] * pi / 180;
    const double goal = s["weight_n"] * std::cos(alpha - beta);
    double low = 1e-6, high = 1e3;
    for (int i = 0; i < 200; ++i) {
        const double middle = std::sqrt(low * high);
        const Forces f = forces(s, middle);
        (f.drag * std::sin(beta) + f.lift * std::cos(beta) < goal ? low : high) = middle;
    }
    return std::sqrt(low * high);
}

double answer(const Scene& s, const std::string& quantity, const std::string& at) {
    if (quantity == "drag_n") return forces(s, std::stod(at)).drag;
    if (quantity == "lift_n") return forces(s, std::stod(at)).lift;
    const double ustar = threshold(s);
    if (quantity == "ustar_m_s") return ustar;
    if (quantity == "reynolds") return ustar * s["d_m"] / s["nu_m2_s"];
    const double excess = (s["rho_sol_kg_m3"] - s["rho_f_kg_m3"]) * s["g_m_s2"] * s["d_m"];
    return s["rho_f_kg_m3"] * ustar * ustar / excess;  // shields
}

int main(int count, char** arguments) {
    if (count != 3) {
        std::cerr << "usage: solver CASE OUT\n";
        return 2;
    }
    const std::string scene_directory = arguments[1];
    const Scene scene(scene_directory + "/scene.json");
    if (scene.word.at("kind") != "closed-form") {
        std::cerr << "this solver does not know the kind " << scene.word.at("kind") << "\n";
        return 2;
    }
    std::ifstream ask(scene_directory + "/ask.csv");
    std::ofstream out(arguments[2]);
    out.precision(17);
    out << "quantity,at,value\n";
    std::string line;
    std::getline(ask, line);  // the head
    while (std::getline(ask, line)) {
        const auto comma = line.find(',');
        const std::string quantity = line.substr(0, comma), at = line.substr(comma + 1);
        out << quantity << ',' << at << ',' << answer(scene, quantity, at) << '\n';
    }
    return 0;
}
