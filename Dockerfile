# rayproof in a container: the command, its references that come with it, and Mesa for the report's 3-D pictures.
#
#     docker build -t rayproof .
#     docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/work" rayproof run primitives --out report
FROM python:3.12-slim-bookworm
RUN apt-get update \
    && apt-get install -y --no-install-recommends libatomic1 libegl1 libgl1-mesa-dri \
    && rm -rf /var/lib/apt/lists/*
COPY requirements.txt /opt/rayproof/
RUN python -m pip install --no-cache-dir --require-hashes -r /opt/rayproof/requirements.txt \
    # The wheel that carries LLVM makes its library links at the first start of Python after its installation.
    && python -c pass
COPY . /opt/rayproof/
RUN python -m pip install --no-cache-dir --no-deps --no-build-isolation /opt/rayproof \
    && useradd --create-home rayproof \
    && install -d -o rayproof /work /cache
# Whoever runs it may be any user: what is kept between runs needs a place that all may write.
ENV RAYPROOF_CACHE=/cache HOME=/home/rayproof
RUN chmod 1777 /cache /home/rayproof
USER rayproof
WORKDIR /work
ENTRYPOINT ["rayproof"]
CMD ["--help"]
