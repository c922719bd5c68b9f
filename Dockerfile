# docker build -t mouthpiece . && docker run --rm -v "$PWD:/work" mouthpiece --text "the time is now" --out out
FROM debian:bookworm AS build
COPY . /src
WORKDIR /src
RUN apt-get update && apt-get install -y --no-install-recommends make ca-certificates git && make deb

FROM debian:bookworm-slim
COPY --from=build /src/build/mouthpiece_*.deb /tmp/
RUN apt-get update && apt-get install -y --no-install-recommends /tmp/mouthpiece_*.deb \
    && rm -rf /tmp/mouthpiece_*.deb /var/lib/apt/lists/*
WORKDIR /work
ENTRYPOINT ["synth"]
